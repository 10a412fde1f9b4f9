"""Robot -> URDF -> robot: names, poses, limits, inertia and shapes; and refused robots."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim import robots
from robsim.geometry.rotation import rotation_to_rpy
from robsim.robot.urdf.attribute_values import find_axis_rotation
from robsim.robot.urdf.shape_export import split_into_solids

KINDS = {"fixed", "revolute", "prismatic", "floating", "planar"}


def expressible(robot):
    joints = [link.joint for link in robot.links]
    return all(j.kind in KINDS and isinstance(j.follows, rs.joints.Mimic | None) for j in joints)


LIBRARY = [name for name in robots.names() if expressible(robots.load(name))]


def again(robot, folder):
    robot.to_urdf(folder / "robot.urdf")
    return rs.Robot.from_urdf(folder / "robot.urdf")


def some_coordinates(robot, rng, runs=5):
    """Within the limits, if there are any, and with quaternions of length 1."""
    q = rng.normal(size=(runs, robot.nq))
    low, high = np.maximum(robot.limits.T, [[-9.0], [-np.inf]])
    free = ~np.isfinite(robot.limits).all(axis=1)
    q[:, ~free] = rng.uniform(low[~free], high[~free], (runs, (~free).sum()))
    for i, name in enumerate(robot.coordinate_names):
        if name.endswith(".qx"):
            q[:, i : i + 4] /= np.linalg.norm(q[:, i : i + 4], axis=1, keepdims=True)
    return q


def close(a, b, tolerance=1e-12):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def alike(robot, back, rng):
    """The same to 1e-12, at random configurations, link by link."""
    assert [k.name for k in back.links] == [k.name for k in robot.links]
    assert [k.parent for k in back.links] == [k.parent for k in robot.links]
    assert back.coordinate_names == robot.coordinate_names
    assert back.velocity_names == robot.velocity_names and back.tip == robot.tip
    q = some_coordinates(robot, rng)
    close(back.frames(q), robot.frames(q))
    for link in robot.links:
        close(back.jacobian(q, link.name), robot.jacobian(q, link.name))
    np.testing.assert_array_equal(back.limits, robot.limits)
    for one, other in zip(robot.links, back.links, strict=True):
        assert one.joint.kind == other.joint.kind and one.joint.limits == other.joint.limits
        for part in ("speed", "effort", "damping", "friction"):
            assert getattr(one.joint, part) == getattr(other.joint, part)
        same_follows(one.joint.follows, other.joint.follows, robot)
        same_inertia(one.inertial, other.inertial)
        same_shapes(one.shapes, other.shapes)


def same_follows(one, other, robot):
    """A follower of a follower is written as a follower of the first joint."""
    if one is not None and one.of not in robot.coordinate_names:
        assert other.of in robot.coordinate_names
    else:
        assert one == other


def same_inertia(one, other):
    assert (one is None) == (other is None)
    if one is not None:
        assert one == other


def same_shapes(shapes, others):
    """Compare the solids that URDF supports, or their substitutes, except the points of circles."""
    known = (rs.Block, rs.Wheel, rs.shapes.Ball, rs.shapes.Mesh)
    written = [each for shape in shapes for each in split_into_solids(shape, known)]
    for one, other in zip(written, others, strict=True):
        close(one.pose.matrix, other.pose.matrix)
        mine, theirs = vars(one) | {"n": 0}, vars(other) | {"n": 0}
        for part in ("pose", "vertices", "mass", "density", "source"):
            mine.pop(part, None), theirs.pop(part, None)
        assert type(one) is type(other) and mine == theirs


@pytest.mark.filterwarnings("ignore:.*no rigid body has:robsim.errors.FileWarning")  # puma560
@pytest.mark.parametrize("name", LIBRARY)
def test_a_robot_of_the_library_comes_back(name, tmp_path):
    robot = robots.load(name)
    alike(robot, again(robot, tmp_path), np.random.default_rng(1))


def test_most_of_the_library_can_be_written():
    assert set(LIBRARY) >= {
        *("puma560", "panda", "rhino_xr4", "planar_2r", "pan_tilt", "conveyor", "turntable"),
        *("holonomic_base", "mobile_arm", "free_camera"),
    }


def test_a_tip_that_the_links_do_not_suggest_comes_back(tmp_path):
    """Other programs leave the element out; an element without new data is not written."""
    arm = robots.panda()
    assert "robsim" not in write_urdf(arm, tmp_path)
    held = dataclasses.replace(arm, tip=arm.links[4].name)
    assert f'<robsim tip="{held.tip}"/>' in write_urdf(held, tmp_path)
    assert again(held, tmp_path).tip == held.tip != arm.tip
    assert again(arm, tmp_path).tip == arm.tip


def write_urdf(robot, folder):
    robot.to_urdf(folder / "robot.urdf")
    return (folder / "robot.urdf").read_text()


def any_pose(rng):
    """Often with right angles, where roll and yaw are one, and with zeros."""
    turns = rng.integers(-2, 3, 3) * np.pi / 2 + rng.choice([0, 0, 1e-9, 1.0], 3) * rng.normal(
        size=3
    )
    return rs.Pose.at(*(rng.choice([0, 1], 3) * rng.normal(size=3)), rpy=turns)


def any_shapes(rng):
    a, b, c = rng.uniform(0.01, 1, 3)
    every = (
        rs.Block(a, b, c, "r", mass=a),
        rs.Wheel(a, b, color="#12ab9f", density=100.0),
        rs.shapes.Ball(a, color="k"),
        rs.shapes.Mesh("package://a/m & m.stl", (a, -b, 1.0)),
    )
    return tuple(shape.at(any_pose(rng)) for shape in every[: rng.integers(5)])


def any_link(rng, i):
    kind = rng.choice(["fixed", "revolute", "prismatic", "floating", "planar"])
    tail = any_pose(rng) if rng.integers(2) else rs.Pose.at()
    limits = tuple(np.sort(rng.normal(size=2))) if kind in ("revolute", "prismatic") else None
    numbers = ("speed", "effort", "damping", "friction")
    drive = {part: rng.uniform(0.1, 9) for part in numbers if kind in ("revolute", "prismatic")}
    joint = rs.joints.Joint(
        kind,
        any_pose(rng),
        tail,
        limits if rng.integers(2) else None,
        name=None if rng.integers(2) else f"joint{i}",
        **drive,
    )
    parent = "base" if i == 1 else ["base", *(f"link{k}" for k in range(1, i))][rng.integers(i)]
    inertia = rs.shapes.Ball(0.3, mass=2.0).at(any_pose(rng)).inertia
    if rng.integers(2):  # as published, about one axis
        inertia = rs.shapes.Inertia(0.0, any_pose(rng).position, np.diag([0, 2.0, 0]))
    inertia = inertia if rng.integers(2) else None
    return rs.joints.Link(f"link{i}", parent, joint, any_shapes(rng), inertia)


def test_an_inertia_that_no_body_has_comes_back_with_a_warning(tmp_path):
    needle = rs.shapes.Inertia(2.0, (0.1, 0, 0), np.diag([-1, 0.3, 7]), strict=False)
    arm = rs.Robot("arm", [rs.joints.Link("base"), rs.joints.Link("a", "base", inertia=needle)])
    with pytest.warns(rs.errors.FileWarning, match="no rigid body has this inertia: .* kept"):
        assert again(arm, tmp_path).links[1].inertia == needle


def any_robot(rng):
    """A tree of joints of all kinds that the format has; the last ones follow others."""
    links = [
        rs.joints.Link("base", shapes=any_shapes(rng)),
        *(any_link(rng, i) for i in range(1, 6)),
    ]
    single = [k.joint.name or k.name for k in links if k.joint.kind in ("revolute", "prismatic")]
    for i in range(2 if single else 0):
        follows = rs.joints.Mimic(rng.choice(single), rng.normal(), rng.normal())
        joint = rs.joints.Joint("revolute", tail=any_pose(rng), follows=follows)
        links.append(rs.joints.Link(f"tied{i}", links[-1].name, joint))
        single.append(f"tied{i}")
    return rs.Robot("any", links)


@pytest.mark.full
@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.integers(0, 2**32))
def test_any_robot_comes_back(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    robot = any_robot(rng)
    alike(robot, again(robot, tmp_path_factory.mktemp("any")), rng)


def test_a_file_of_ours_is_written_again_in_the_same_words(tmp_path):
    """After one reading, numbers may differ in their last digits alone."""
    first, second = tmp_path / "first.urdf", tmp_path / "second.urdf"
    robots.panda().to_urdf(first)
    rs.Robot.from_urdf(first).to_urdf(second)
    one, other = first.read_text().split('"'), second.read_text().split('"')
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        if a != b:
            close(np.array(a.split(), float), np.array(b.split(), float))


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.integers(0, 2**32))
def test_roll_pitch_and_yaw_give_the_rotation_again(seed):
    rng = np.random.default_rng(seed)
    R = any_pose(rng).rotation @ any_pose(rng).rotation
    close(rs.Pose.at(rpy=rotation_to_rpy(R)).rotation, R, 2e-15)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.integers(0, 2**32))
def test_the_frame_of_an_axis_is_a_rotation_to_the_last_digit(seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3) * 10.0 ** rng.integers(-9, 1, 3)
    axis /= np.linalg.norm(axis)
    R = find_axis_rotation(axis)
    close(R.T @ R, np.eye(3), 1e-15)
    assert (R[:, 2] == axis).all() and np.linalg.det(R) > 0


def test_robots_that_the_format_cannot_express_are_refused_by_name_all_at_once(tmp_path):
    path = tmp_path / "rover.urdf"
    car = rs.joints.Joint("car", steering=rs.joints.Steering(0.5))
    wheel = rs.joints.Joint("revolute", follows=rs.joints.Ackermann("body.steering"))
    rover = rs.Robot(
        "rover",
        [
            rs.joints.Link("base"),
            rs.joints.Link("body", "base", car),
            rs.joints.Link("wheel", "body", wheel),
        ],
    )
    expected = "'body' moves as a car; 'wheel' follows by Ackermann, not Mimic"
    with pytest.raises(
        rs.errors.InputError, match=f"robot 'rover' cannot be written as URDF: {expected}"
    ):
        rover.to_urdf(path)
    assert not path.exists()


@pytest.mark.parametrize("color", [3, "a\0"])
def test_a_colour_that_is_none_is_refused(color):
    with pytest.raises(rs.errors.InputError, match=r"Ball\.color: no colour"):
        rs.shapes.Ball(1, color=color)


@pytest.mark.parametrize("color", [(1, 0, 0), [1, 0, 0]])
def test_a_colour_that_is_no_word_is_refused_by_the_name_of_its_link(tmp_path, color):
    robot = rs.Robot("r", [rs.joints.Link("base", shapes=(rs.shapes.Ball(1, color=color),))])
    for write in (robot.to_urdf, robot.to_mjcf):
        with pytest.raises(rs.errors.InputError, match="'base' has a colour that is no word"):
            write(tmp_path / "robot.xml")


def test_where_a_file_cannot_be_written_is_reported(tmp_path):
    (tmp_path / "file").write_text("mine")
    for write in (robots.panda().to_urdf, robots.panda().to_mjcf):
        with pytest.raises(rs.errors.FileError, match=r"cannot write .*robot\.xml"):
            write(tmp_path / "file" / "robot.xml")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_name_that_two_joints_would_have_is_given_to_the_one_that_moves(tmp_path):
    turn = rs.joints.Link("a", "base", rs.joints.Joint("revolute", name="b"))
    robot = rs.Robot("r", [rs.joints.Link("base"), turn, rs.joints.Link("b", "a")])
    back = again(robot, tmp_path)
    assert back.coordinate_names == ("b",) and back.links[2].joint.name == "b_fixed"


def test_names_of_joints_that_do_not_move_never_clash(tmp_path):
    turn, still = rs.joints.Joint("revolute", name="b"), rs.joints.Joint(name="x")
    long = "l" * 64
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("a", "base", turn),
        rs.joints.Link("b", "a"),
        rs.joints.Link("b_fixed", "b"),
        rs.joints.Link("c", "b", still),
        rs.joints.Link("d", "c", still),
        rs.joints.Link("x", "d"),
        rs.joints.Link("e", "x", rs.joints.Joint("prismatic", name=long)),
        rs.joints.Link(long, "e"),
    ]
    back = again(rs.Robot("r", links), tmp_path)
    assert back.coordinate_names == ("b", long)
    assert [k.name for k in back.links] == [k.name for k in links]
    names = [k.joint.name or k.name for k in back.links[1:]]
    assert len(set(names)) == len(names) and max(map(len, names)) == 64


def test_the_body_of_a_camera_becomes_two_boxes_as_long(tmp_path):
    body = rs.CameraBody(0.08, 0.05, 0.03, mass=0.2)
    arm = rs.Robot(
        "r",
        [
            rs.joints.Link("base"),
            rs.joints.Link("eye", "base", rs.joints.Joint("revolute"), (body,)),
        ],
    )
    eye = again(arm, tmp_path).links[1]
    points = np.concatenate([box.vertices for box in eye.shapes])
    close(np.ptp(points, axis=0), [1.25 * 0.03, 1.25 * 0.05, 0.08])
    assert eye.inertia == body.inertia


def test_colours_that_files_have_no_name_for_become_grey(tmp_path):
    wheel = rs.Wheel(1, 1, color="tab:blue")
    robot = rs.Robot(
        "r", rs.joints.Link("base", shapes=(wheel, dataclasses.replace(wheel, color="#0f0")))
    )
    assert [s.color for s in again(robot, tmp_path).links[0].shapes] == ["#808080", "g"]


def servo(arm):
    """An eye on its last link that looks at a square from half a metre away."""
    q = np.array([0, -0.5, 0, -2, 0, 1.6, 0.8])
    square = rs.Pose(arm.fk(q)) @ rs.Pose.at(0, 0, 0.5)
    marks = [(x, y, 0) for x, y in ((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1))]
    eye = rs.MountedCamera(
        "eye", rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]), on="panda.flange"
    )
    scene = rs.Scene([arm], [rs.Object("square", marks=marks, pose=square)], [eye])
    return scene, rs.IBVS(goal=q), q + 0.03


def test_a_robot_from_a_file_servos_like_the_one_that_was_written(tmp_path):
    runs = []
    for arm in (robots.panda(), again(robots.panda(), tmp_path)):
        scene, task, q = servo(arm)
        runs.append(rs.simulate(scene, task, q, duration=1.0))
    close(runs[0]["q"], runs[1]["q"], 1e-10)
    assert float(runs[0]["error_norm"][-1]) < 0.5 * float(runs[0]["error_norm"][0])


def test_a_run_of_a_robot_from_a_file_is_repeated_from_its_text(tmp_path):
    """The text of the scenario holds the robot, inertias and meshes too: no file is needed."""
    arm = rs.Robot.from_urdf(Path(__file__).parents[1] / "inputs" / "urdf" / "00_good.urdf")
    stone = rs.shapes.Mesh("package://stones/stone.stl", (1, 1, 0.5))
    weighed = dataclasses.replace(arm.links[1], shapes=(stone, rs.shapes.Ball(0.1, mass=0.3)))
    arm = dataclasses.replace(arm, links=(arm.links[0], weighed))
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), on="r.b")
    dots = rs.Object("dots", marks=[(0.1, 0, 2), (0, 0.2, 2), (0, 0, 3), (0.1, 0.1, 3)])
    run = rs.simulate(rs.Scene([arm], [dots], [eye]), rs.IBVS(goal=[0.1]), [0.0], duration=0.2)
    assert rs.replay(run).identical(run)
