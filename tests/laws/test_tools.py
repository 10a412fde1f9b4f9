"""Tools on arms, and objects that change hands: nothing jumps, names stay apart."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim import Pose, Robot
from robsim.errors import FrameError, InputError
from robsim.joints import Joint, Link, Mimic

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)
BACK = Pose.at(z=-0.1083)  # place of the gripper on the Rhino, from its tool frame


def close(a, b, tolerance=1e-14):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def anywhere(rng):
    return Pose.at(*rng.normal(size=3), rpy=rng.normal(size=3))


@pytest.fixture(scope="module")
def rhino():
    return rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), BACK, bare=True)


# a tool


@steady
@given(seeds)
def test_poses_of_an_arm_with_a_tool_are_products(seed):
    rng = np.random.default_rng(seed)
    arm, tool = rs.robots.puma560(), rs.robots.pan_tilt().at(anywhere(rng))
    at, on = anywhere(rng), ("forearm", "flange")[rng.integers(2)]
    both = arm.with_tool(tool, at, on)
    q, p = rng.normal(size=(5, 6)), rng.normal(size=(5, 2))
    mount = arm.fk(q, on) @ (at @ tool.base).matrix
    for link, expected in zip(tool.links, np.moveaxis(tool.frames(p), 1, 0), strict=True):
        name = link.name if link.name != "base" else "pan_tilt_base"
        close(both.fk(np.hstack([q, p]), name), mount @ expected)
    for link in arm.links:
        np.testing.assert_array_equal(both.fk(np.hstack([q, p]), link.name), arm.fk(q, link.name))
    assert both.tip == "head" and (both.nq, both.nv) == (8, 8)


@steady
@given(seeds)
def test_its_jacobian_agrees_with_the_arm_at_its_place_and_its_own(seed):
    rng = np.random.default_rng(seed)
    arm, tool, at = rs.robots.puma560(), rs.robots.pan_tilt(), anywhere(rng)
    q, p = rng.normal(size=6), rng.normal(size=2)
    J = arm.with_tool(tool, at).jacobian(np.r_[q, p])
    mount = arm.fk(q) @ at.matrix
    tip = mount @ tool.fk(p)
    lever = tip[:3, 3] - arm.fk(q)[:3, 3]
    v, omega = np.split(arm.jacobian(q), 2)
    close(J[:, :6], np.vstack([v + np.cross(omega.T, lever).T, omega]))
    own = tool.jacobian(p).reshape(2, 3, 2)
    close(J[:, 6:], (mount[:3, :3] @ own).reshape(6, 2))


def test_the_chapters_rhino_opens_and_closes_its_gripper(rhino):
    """Arm, tool frame, home and limits are as they were; the gripper moves its fingers only."""
    arm = rs.robots.rhino_xr4()
    q = arm.home + np.radians([40, 10, -20, 10, 30])
    for opening in (0.0, 0.03, 0.055):
        full = np.r_[q, opening]
        np.testing.assert_array_equal(rhino.fk(full), arm.fk(q))
        np.testing.assert_array_equal(rhino.fk(full, "tool"), arm.fk(q))
        left, right = (rhino.fk(full, f"finger_{side}")[:3, 3] for side in ("left", "right"))
        assert np.linalg.norm(right - left) == pytest.approx(opening, abs=1e-15)
        close(0.5 * (left + right), arm.fk(q)[:3, 3])
    np.testing.assert_array_equal(rhino.home, [*arm.home, 0.04])
    np.testing.assert_array_equal(rhino.limits, [*arm.limits, [0.0, 0.055]])
    moved = {n.name for n in rhino.links if rhino.jacobian(rhino.home, n.name)[:, 5].any()}
    assert moved == {"opening", "finger_left", "finger_right"}
    speeds = [rhino.jacobian(rhino.home, f"finger_{side}")[:3, 5] for side in ("left", "right")]
    close(speeds[0], -speeds[1])
    close(np.linalg.norm(speeds, axis=1), 0.5)


def test_at_home_it_looks_as_the_chapter_draws_it(rhino):
    """Figures 9 and 10: the same blocks in the same places."""
    arm = rs.robots.rhino_xr4()
    for offset in ([0, 0, 0, 0, 0], np.radians([40, 10, -20, 10, 30])):
        q = arm.home + offset
        ours, theirs = (
            sorted(
                shape.at(T).vertices.round(12).tolist()
                for link, T in zip(robot.links, robot.frames(state), strict=True)
                for shape in link.shapes
            )
            for robot, state in ((rhino, np.r_[q, 0.04]), (arm, q))
        )
        close(ours, theirs, 2e-12)


def test_shapes_of_the_link_that_carries_it_stay_unless_it_is_bare(rhino):
    drawn = rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), BACK)
    shapes = {link.name: link.shapes for link in drawn.links}
    assert len(shapes["tool"]) == 3 and len(shapes["palm"]) == 1
    assert next(link for link in rhino.links if link.name == "tool").shapes == ()


def test_the_tip_of_the_tool_becomes_the_tip_of_both(rhino):
    """Also if it is not the last link, and if the name is taken."""
    arm, tool = rs.robots.puma560(), rs.robots.rhino_gripper()
    assert rhino.tip == tool.tip == "tip"
    left = replace(tool, tip="finger_left")
    both = arm.with_tool(left)
    assert both.tip == "finger_left" and rhino.with_tool(left.named("b")).tip == "b_finger_left"
    q = np.append(arm.home, 0.02)
    np.testing.assert_array_equal(both.fk(q), both.fk(q, "finger_left"))
    np.testing.assert_array_equal(both.jacobian(q), both.jacobian(q, "finger_left"))


def test_the_tip_is_the_last_link_or_the_one_that_is_named():
    arm = rs.robots.puma560()
    held = rs.Robot("puma560", arm.links, arm.home, tip="forearm")
    assert arm.tip == arm.links[-1].name and held != arm == replace(held, tip="")
    np.testing.assert_array_equal(held.fk(arm.home), arm.fk(arm.home, "forearm"))
    assert held.at(Pose.at(1), on="desk").named("b").tip == "forearm"
    with pytest.raises(
        rs.errors.FrameError, match="no frame 'forarm' in robot 'puma560'; did you mean"
    ):
        replace(arm, tip="forarm")


def test_names_that_clash_get_the_prefix_of_the_tool(rhino):
    """So two grippers on one arm move apart, each with its own fingers."""
    two = rhino.with_tool(rs.robots.rhino_gripper().named("other"), Pose.at(0, 0.1, 0))
    assert two.coordinate_names[-2:] == ("opening", "other_opening") and two.tip == "other_tip"
    q = np.r_[rhino.home, 0.02]
    for prefix, opening in (("", 0.04), ("other_", 0.02)):
        left, right = (two.fk(q, f"{prefix}finger_{side}")[:3, 3] for side in ("left", "right"))
        assert np.linalg.norm(right - left) == pytest.approx(opening, abs=1e-15)
    with pytest.raises(InputError, match=r"would be called 'other_.*tool.named\('other_2'\)"):
        two.with_tool(rs.robots.rhino_gripper().named("other"))


def test_a_tool_keeps_its_mass():
    weight = rs.shapes.Inertia(2.0, (0.0, 0.0, 0.1), np.eye(3))
    links = [Link("palm", inertia=weight), Link("jaw", "palm", Joint("revolute"), inertia=weight)]
    plain = Robot("arm", [Link("base"), Link("hand", "base", Joint("revolute"), inertia=weight)])
    carried = plain.with_tool(Robot("tool", links), bare=True)
    assert [link.inertia for link in carried.links] == [None, weight, weight, weight]


def test_joints_with_names_of_their_own_keep_them_or_get_the_tools():
    slide = Joint("prismatic", name="way")
    tool = Robot(
        "tool",
        [
            Link("root"),
            Link("slide", "root", slide),
            Link("back", "slide", Joint("prismatic", follows=Mimic("way", -1))),
        ],
        [0.3],
    )
    once = tool.with_tool(tool.named("top"))
    assert once.coordinate_names == ("way", "top_way")
    assert [link.name for link in once.links][3:] == ["top_root", "top_slide", "top_back"]
    close(once.fk([0.3, 5.0])[:3, 3], 0)  # each goes forth and back by its own
    plain = Robot("arm", [Link("base"), Link("way", "base", Joint("revolute"))])
    mixed = plain.with_tool(tool)
    assert mixed.coordinate_names == ("way", "tool_way")
    close(mixed.fk([0.0, 0.2])[:3, 3], 0)


def test_an_arm_on_a_car_is_a_tool_too():
    """Its wheels roll, its front wheels steer, and the arm has a Jacobian with both."""
    robot = rs.robots.car().with_tool(rs.robots.rhino_xr4(), Pose.at(0.05, 0, 0.18), "body")
    assert robot.nv == 2 + 5 and robot.nq == 8 + 5
    assert "rhino_xr4_base" in [link.name for link in robot.links]
    rng = np.random.default_rng(3)
    q = robot.home.copy()
    q[:3], q[3] = rng.normal(size=3), 0.2
    turn = np.tan(0.2) / 0.3302
    v = np.r_[0.5, 0.5 * turn, rng.normal(size=5)]
    h = 1e-5
    ahead, behind = (robot.fk(robot.integrate(q, v, s))[:3, 3] for s in (h, -h))
    close((ahead - behind) / (2 * h), robot.jacobian(q)[:3] @ v, 1e-9)
    rolled = robot.integrate(q, v, 0.1)
    assert rolled[4] == pytest.approx(0.1 / 0.055 * (0.5 - 0.1325 * 0.5 * turn), abs=1e-14)


@pytest.mark.parametrize(
    ("make", "error", "told"),
    [
        (lambda arm, tool: arm.with_tool(3), InputError, "tool: expected a Robot, got 3"),
        (lambda arm, tool: arm.with_tool(tool, 3), InputError, "pose of the tool 'rhino_gripper'"),
        (lambda arm, tool: arm.with_tool(tool, on="tol"), FrameError, "did you mean 'tool'"),
        (lambda arm, tool: arm.with_tool(tool, bare=1), InputError, "bare must be True or False"),
        (
            lambda arm, tool: arm.with_tool(tool.at(BACK, on="desk")),
            InputError,
            "'rhino_gripper' stands on 'desk', not on 'rhino_xr4'",
        ),
    ],
)
def test_an_invalid_tool_is_refused(make, error, told):
    with pytest.raises(error, match=told):
        make(rs.robots.rhino_xr4(), rs.robots.rhino_gripper())


# hand-overs


MARKS = [[0, 0, 0], [0.04, 0, 0], [0, 0.03, 0.01], [0.01, 0.02, -0.03]]


def bench(rhino, conveyor=True):
    """The Rhino before a moving belt, a cup, and a camera that watches."""
    belt = rs.robots.conveyor().at(Pose.at(0.3, 0.2, -0.5, rpy=(0, 0, 0.3)))
    cup = rs.Object("cup", marks=MARKS, pose=Pose.at(0.3, 0.1, 0.05, rpy=(0.1, 0.2, 0.3)))
    lid = rs.Object("lid", marks=MARKS, pose=Pose.at(0, 0, 0.05), on="cup")
    camera = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    eye = rs.MountedCamera("eye", camera, pose=Pose.at(0.3, 0, 2.0, rpy=(np.pi, 0, 0)))
    return rs.Scene([rhino, belt], [cup, lid], [eye])


@steady
@given(seeds)
def test_an_object_stays_where_it_is_from_hand_to_hand(seed):
    """Poses to 1e-14 m and pixels to 1e-10 after each of ten hand-overs, wherever all are."""
    rng = np.random.default_rng(seed)
    rhino = rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), BACK, bare=True)
    scene = bench(rhino)
    frames = ["rhino_xr4.tool", "conveyor.belt", "world", "rhino_xr4.finger_left", "eye"]
    low, high = scene.limits.T
    for to in rng.permutation(frames * 2):
        q = rng.uniform(low, high)
        after = scene.attached("cup", str(to), q)
        for name in ("cup", "lid"):
            close(after.pose(name, q).matrix, scene.pose(name, q).matrix)
            before, now = (s.view(q, points=name) for s in (scene, after))
            seen = before.depth > 0.2
            close(now.pixels[seen], before.pixels[seen], 1e-10)
        assert after.object("cup").on == to
        scene = after


def test_a_held_object_moves_with_the_gripper_and_a_released_one_stays(rhino):
    scene = bench(rhino)
    q0 = scene.home
    held = scene.attached("cup", "rhino_xr4.tool", q0)
    grasp = held.pose("rhino_xr4.tool", q0).inv() @ held.pose("cup", q0)
    q1 = q0 + 0.2
    there = held.pose("rhino_xr4.tool", q1).matrix @ grasp.matrix
    close(held.pose("cup", q1).matrix, there)
    put = held.released("cup", q1)
    for q in (q0, q1):
        close(put.pose("cup", q).matrix, there)
    assert put.object("cup").on == "world"
    np.testing.assert_array_equal(scene.pose("cup").position, [0.3, 0.1, 0.05])  # as it was


def test_q_may_name_robots_and_is_home_by_default(rhino):
    scene = bench(rhino)
    named = scene.attached("cup", "conveyor.belt", {"conveyor": [0.5]})
    close(named.pose("cup", {"conveyor": [1.5]}).position - scene.pose("cup").position,
          Pose.at(rpy=(0, 0, 0.3)) @ [1.0, 0, 0])  # fmt: skip
    assert scene.attached("cup", "conveyor.belt") == scene.attached(
        "cup", "conveyor.belt", scene.home
    )


@pytest.mark.parametrize(
    ("call", "error", "told"),
    [
        (lambda s: s.attached("cap", "world"), InputError, "did you mean 'cup'"),
        (lambda s: s.attached("cup", "rhino_xr4.tol"), FrameError, "did you mean 'rhino_xr4.tool'"),
        (lambda s: s.attached("cup", 3), FrameError, "no frame 3"),
        (lambda s: s.attached("cup", "cup"), FrameError, "'cup' cannot hang from itself"),
        (
            lambda s: s.attached("cup", "lid"),
            FrameError,
            "'cup' cannot hang from 'lid', which stands on it",
        ),
        (lambda s: s.released("cup", [0.0]), InputError, r"expected shape \(..., 7\)"),
        (
            lambda s: s.released("cup", [s.home] * 2),
            InputError,
            r"q: 'cup' needs one state \(7,\) of the scene, got \(2, 7\)",
        ),
        (lambda s: s.released("rhino_xr4"), InputError, "no object 'rhino_xr4' in the scene"),
    ],
)
def test_a_hand_over_that_cannot_be_is_refused(rhino, call, error, told):
    with pytest.raises(error, match=told):
        call(bench(rhino))
