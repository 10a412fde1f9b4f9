"""Robots: chains are products of their parts, Jacobians are derivatives, motion is exact."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

steady = settings(derandomize=True, max_examples=30, deadline=None)
seeds = st.integers(0, 2**32)

SIZES = {"fixed": (0, 0), "revolute": (1, 1), "prismatic": (1, 1), "floating": (7, 6)}


def close(a, b, tolerance=1e-13):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


# elementary motions, written out


def turn_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def turn_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def shift(x, y, z):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def motion(kind, q):
    if kind == "revolute":
        return turn_z(q[0])
    if kind == "prismatic":
        return shift(0, 0, q[0])
    T = np.eye(4)
    if kind == "floating":
        T, (x, y, z, w) = shift(*q[:3]), q[3:]
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        T[:3, :3] += 2 * w * cross + 2 * cross @ cross
    return T


# robots of every kind


def some_pose(rng):
    return rs.Pose.exp(rng.normal(size=6))


def branching(seed=0):
    """Seven links of every kind in a tree: a - b - c - d, a - e - f, a - g."""
    rng = np.random.default_rng(seed)
    plan = [
        ("b", "a", "revolute"),
        ("c", "b", "floating"),
        ("d", "c", "prismatic"),
        ("e", "a", "prismatic"),
        ("f", "e", "fixed"),
        ("g", "f", "revolute"),
        ("h", "a", "fixed"),
    ]
    links = [
        rs.joints.Link(name, parent, rs.joints.Joint(kind, some_pose(rng), some_pose(rng)))
        for name, parent, kind in plan
    ]
    return rs.Robot("tree", [rs.joints.Link("a"), *links])


def some_q(robot, seed=0, lead=()):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(*lead, robot.nq))
    for i, name in enumerate(robot.coordinate_names):
        if name.endswith(".qx"):
            q[..., i : i + 4] /= np.linalg.norm(q[..., i : i + 4], axis=-1, keepdims=True)
    return q


def integrate(robot, q, v, dt):
    return robot.integrate(q, v, dt)


# forward kinematics


@steady
@given(seeds, st.text("RP", min_size=1, max_size=7))
def test_a_standard_dh_chain_is_a_product_of_elementary_motions(seed, joints):
    """Chapter, eqs. 3 and 4: T = Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    rng = np.random.default_rng(seed)
    rows, q = rng.normal(size=(len(joints), 4)), rng.normal(size=len(joints))
    robot, T = rs.Robot.from_dh(rows, "standard", joints), np.eye(4)
    for (theta, d, a, alpha), x, joint in zip(rows, q, joints, strict=True):
        angle, rise = (theta + x, d) if joint == "R" else (theta, d + x)
        T = T @ turn_z(angle) @ shift(0, 0, rise) @ shift(a, 0, 0) @ turn_x(alpha)
    close(robot.fk(q), T, 1e-12)


@steady
@given(seeds, st.text("RP", min_size=1, max_size=7))
def test_a_modified_dh_chain_is_a_product_of_elementary_motions(seed, joints):
    """Craig: T = Rx(alpha) Tx(a) Rz(theta) Tz(d)."""
    rng = np.random.default_rng(seed)
    rows, q = rng.normal(size=(len(joints), 4)), rng.normal(size=len(joints))
    robot, T = rs.Robot.from_dh(rows, "modified", joints), np.eye(4)
    for (theta, d, a, alpha), x, joint in zip(rows, q, joints, strict=True):
        angle, rise = (theta + x, d) if joint == "R" else (theta, d + x)
        T = T @ turn_x(alpha) @ shift(a, 0, 0) @ turn_z(angle) @ shift(0, 0, rise)
    close(robot.fk(q), T, 1e-12)


def test_one_dh_row_is_equation_3_of_the_chapter():
    theta, d, a, alpha = 0.3, 0.5, -0.7, 1.1
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    by_hand = [
        [c, -ca * s, sa * s, a * c],
        [s, ca * c, -sa * c, a * s],
        [0, sa, ca, d],
        [0, 0, 0, 1],
    ]
    close(rs.Robot.from_dh([[0.1, d, a, alpha]]).fk([0.2]), by_hand, 1e-15)


@steady
@given(seeds)
def test_a_tree_of_every_kind_of_joint_is_a_product_along_each_branch(seed):
    robot = branching(seed)
    q = some_q(robot, seed)
    T, start = {"a": np.eye(4)}, 0
    for link in robot.links[1:]:
        size = SIZES[link.joint.kind][0]
        moved = motion(link.joint.kind, q[start : start + size])
        T[link.name] = T[link.parent] @ link.joint.place.matrix @ moved @ link.joint.tail.matrix
        start += size
    close(robot.frames(q), [T[link.name] for link in robot.links], 1e-12)
    for name, expected in T.items():
        close(robot.fk(q, name), expected, 1e-12)


def test_a_floating_joint_is_the_pose_of_its_coordinates():
    body = rs.joints.Link("body", "base", rs.joints.Joint("floating"))
    robot = rs.Robot("free", [rs.joints.Link("base"), body])
    T = rs.Pose.at(1, 2, 3, rotvec=(0.3, -1.0, 0.5))
    close(robot.fk(T.q), T, 1e-15)
    close(robot.fk(T), T, 1e-15)  # a pose is taken for its coordinates
    close(robot.fk(robot.home), np.eye(4), 0)
    names = ("body.x", "body.y", "body.z", "body.qx", "body.qy", "body.qz", "body.qw")
    assert robot.coordinate_names == names
    assert (robot.nq, robot.nv) == (7, 6)


def test_the_base_does_not_enter_a_robot_s_own_frame():
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]])
    there = arm.at(rs.Pose.at(5, 5, 5, rpy=(1, 1, 1)))
    np.testing.assert_array_equal(there.fk([0.1, 0.2]), arm.fk([0.1, 0.2]))
    close(there.at(rs.Pose.at(1, 0, 0)).base, rs.Pose.at(6, 5, 5, rpy=(1, 1, 1)), 1e-15)


def test_any_leading_dimensions_are_a_loop_bit_for_bit():
    robot = branching(1)
    q = some_q(robot, 2, (3, 5))
    whole = robot.fk(q), robot.frames(q), robot.jacobian(q), robot.jacobian(q, "d")
    assert [a.shape for a in whole] == [
        (3, 5, 4, 4),
        (3, 5, 8, 4, 4),
        (3, 5, 6, robot.nv),
        (3, 5, 6, robot.nv),
    ]
    for i in np.ndindex(3, 5):
        alone = robot.fk(q[i]), robot.frames(q[i]), robot.jacobian(q[i]), robot.jacobian(q[i], "d")
        for a, b in zip(whole, alone, strict=True):
            np.testing.assert_array_equal(a[i], b)


def test_no_rows_give_no_rows():
    robot = branching()
    assert robot.fk(np.empty((0, robot.nq))).shape == (0, 4, 4)
    assert robot.jacobian(np.empty((2, 0, robot.nq))).shape == (2, 0, 6, robot.nv)


# Jacobians


def differences(robot, q, link, step):
    """(6, nv) central differences of position and rotation, in base axes."""
    columns = []
    for v in np.eye(robot.nv):
        ahead, behind = (robot.fk(integrate(robot, q, v, h), link) for h in (step, -step))
        turn = np.eye(4)
        turn[:3, :3] = ahead[:3, :3] @ behind[:3, :3].T
        columns.append(np.append(ahead[:3, 3] - behind[:3, 3], rs.Pose(turn).rotvec) / (2 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("link", list("abcdefgh"))
def test_jacobians_are_derivatives_of_second_order_at_every_link(link, seed):
    """Central differences miss by the square of the step: the slope in log-log is 2."""
    robot = branching(seed)
    q, steps = some_q(robot, seed + 10), np.array([0.1, 0.05, 0.025])
    J = robot.jacobian(q, link)
    errors = np.array([np.abs(differences(robot, q, link, h) - J).max() for h in steps])
    if link in "aefh":  # only a slide, or nothing, carries these: differences are exact
        assert errors.max() < 1e-13
    else:
        assert (np.diff(np.log(errors)) / np.diff(np.log(steps)) >= 1.8).all()
        assert errors[-1] < 1e-2


@steady
@given(seeds, st.text("RP", min_size=1, max_size=6))
def test_columns_of_a_chain_are_axes_and_their_arms(seed, joints):
    """Revolute: (z x (p - o), z); prismatic: (z, 0), with z and o of the link before."""
    rng = np.random.default_rng(seed)
    robot = rs.Robot.from_dh(rng.normal(size=(len(joints), 4)), joints=joints)
    q = rng.normal(size=len(joints))
    T, J = robot.frames(q), robot.jacobian(q)
    for i, joint in enumerate(joints):
        z, arm = T[i, :3, 2], T[-1, :3, 3] - T[i, :3, 3]
        column = [*np.cross(z, arm), *z] if joint == "R" else [*z, 0, 0, 0]
        close(J[:, i], column, 1e-12)


def test_only_the_joints_on_the_way_to_a_link_move_it():
    robot = branching()
    J = {name: robot.jacobian(some_q(robot), name) for name in "abcdefgh"}
    moving = {name: "".join("01"[int(np.abs(c).max() > 0)] for c in J[name].T) for name in J}
    assert robot.velocity_names == (
        "b",
        *(f"c.{v}" for v in ("vx", "vy", "vz", "wx", "wy", "wz")),
        *"deg",
    )
    assert moving == {
        "a": "0" + "000000" + "0" + "00",
        "b": "1" + "000000" + "0" + "00",
        "c": "1" + "111111" + "0" + "00",
        "d": "1" + "111111" + "1" + "00",
        "e": "0" + "000000" + "0" + "10",
        "f": "0" + "000000" + "0" + "10",
        "g": "0" + "000000" + "0" + "11",
        "h": "0" + "000000" + "0" + "00",
    }


def test_the_velocity_of_a_floating_body_is_its_twist_in_its_own_axes():
    body = rs.joints.Link("body", "base", rs.joints.Joint("floating"))
    robot = rs.Robot("free", [rs.joints.Link("base"), body])
    T = rs.Pose.at(1, 2, 3, rotvec=(0.3, -1.0, 0.5))
    R, zero = T.rotation, np.zeros((3, 3))
    close(robot.jacobian(T), np.block([[R, zero], [zero, R]]), 1e-15)


# motion


@steady
@given(seeds, st.floats(-3, 3))
def test_a_held_twist_moves_a_floating_joint_by_its_exponential(seed, dt):
    robot, rng = branching(), np.random.default_rng(seed)
    q, v = some_q(robot, seed), rng.normal(size=robot.nv)
    after = integrate(robot, q, v, dt)
    before = rs.Pose.from_quaternion(q[1:4], q[4:8])
    close(rs.Pose.from_quaternion(after[1:4], after[4:8]), before @ rs.Pose.exp(dt * v[1:7]))
    close(after[[0, 8, 9, 10]], q[[0, 8, 9, 10]] + dt * v[[0, 7, 8, 9]], 1e-15)


@steady
@given(seeds, st.floats(0.01, 3))
def test_two_half_steps_are_one_step(seed, dt):
    robot, rng = branching(), np.random.default_rng(seed)
    q, v = some_q(robot, seed), rng.normal(size=robot.nv)
    halves = integrate(robot, integrate(robot, q, v, dt / 2), v, dt / 2)
    close(halves, integrate(robot, q, v, dt))
    close(integrate(robot, halves, v, -dt), q)  # and back


def test_the_quaternion_keeps_its_length():
    robot, rng = branching(), np.random.default_rng(3)
    q = some_q(robot)
    for _ in range(1000):
        q = integrate(robot, q, 10 * rng.normal(size=robot.nv), 0.1)
        assert np.linalg.norm(q[4:8]) == pytest.approx(1.0, abs=1e-15)


def test_integration_and_jacobian_agree_to_second_order():
    """T(q + v dt) differs from T + Tdot dt by dt^2."""
    robot, q = branching(), some_q(branching())
    v, steps = np.random.default_rng(4).normal(size=robot.nv), np.array([1e-2, 5e-3, 2.5e-3])
    linear = robot.fk(q, "d")[:3, 3] + steps[:, None] * (robot.jacobian(q, "d") @ v)[:3]
    there = [robot.fk(integrate(robot, q, v, h), "d")[:3, 3] for h in steps]
    errors = np.linalg.norm(there - linear, axis=1)
    assert (np.diff(np.log(errors)) / np.diff(np.log(steps)) >= 1.8).all()


# the order of links


@steady
@given(st.permutations(range(1, 8)))
def test_the_order_of_the_links_only_orders_the_coordinates(order):
    robot = branching()
    other = rs.Robot("tree", [robot.links[0], *(robot.links[i] for i in order)])
    q = some_q(robot)
    named = dict(zip(robot.coordinate_names, q, strict=True))
    q_other = np.array([named[name] for name in other.coordinate_names])
    columns = [robot.velocity_names.index(name) for name in other.velocity_names]
    for link in "abcdefgh":
        np.testing.assert_array_equal(other.fk(q_other, link), robot.fk(q, link))
        np.testing.assert_array_equal(
            other.jacobian(q_other, link), robot.jacobian(q, link)[:, columns]
        )


# trees that are none


def robot_of(*links):
    return rs.Robot("odd", [rs.joints.Link("base"), *links])


@pytest.mark.parametrize(
    ("links", "words"),
    [
        ([("a", "a")], "'a' is its own ancestor, through 'a'"),
        ([("a", "b"), ("b", "a")], "'a' is its own ancestor, through 'b'"),
        ([("ok", "base"), ("a", "c"), ("b", "a"), ("c", "b")], "'a' is its own ancestor, through"),
        ([("a", "bas")], "'a' stands on 'bas', and there is no such frame; did you mean 'base'?"),
        ([("a", "bas")], "frames: world, base, a"),
        ([("a", "base"), ("a", "base")], "two frames are called 'a'"),
        ([("base", "base")], "two frames are called 'base'"),
        ([("world", "base")], "two frames are called 'world'"),
    ],
)
def test_an_invalid_tree_is_reported_with_the_existing_links(links, words):
    with pytest.raises(rs.errors.FrameError) as caught:
        robot_of(*(rs.joints.Link(name, parent) for name, parent in links)).fk([])
    assert words in str(caught.value)


@pytest.mark.parametrize("ask", ["fk", "jacobian"])
def test_an_unknown_link_is_reported_with_those_that_exist(ask):
    arm = rs.robots.rhino_xr4()
    with pytest.raises(rs.errors.FrameError) as caught:
        getattr(arm, ask)(arm.home, "tol")
    assert str(caught.value) == (
        "no frame 'tol' in robot 'rhino_xr4'; did you mean 'tool'? "
        "frames: base, shoulder, upper_arm, forearm, wrist, tool"
    )


def test_only_the_base_has_no_parent():
    with pytest.raises(
        rs.errors.InputError, match="link 'a' has no parent; only the base has none"
    ):
        robot_of(rs.joints.Link("a"))


@pytest.mark.parametrize(
    "base",
    [rs.joints.Link("base", joint=rs.joints.Joint("prismatic")), rs.joints.Link("base", "other")],
    ids=["moves", "hangs"],
)
def test_the_base_neither_moves_nor_hangs_from_anything(base):
    with pytest.raises(rs.errors.InputError, match="it has no parent and does not move"):
        rs.Robot("odd", [base, rs.joints.Link("a", "base", rs.joints.Joint("revolute"))])


def test_a_robot_has_links():
    for nothing in ([], ["base"]):
        with pytest.raises(rs.errors.InputError, match="robot 'odd' needs"):
            rs.Robot("odd", nothing)


@pytest.mark.parametrize("name", ["", "1st", "a b", "a.b", "a/b", "$x$", "é", "a" * 65, 7, None])
def test_names_are_safe_in_files_and_figures(name):
    for make in (rs.joints.Link, lambda n: rs.Robot(n, [rs.joints.Link("base")])):
        with pytest.raises(
            rs.errors.InputError, match="a name starts with a letter and has up to 64"
        ):
            make(name)


# coordinates and limits

ARM = rs.Robot.from_dh(
    [[0, 0, 1, 0], [0, 0, 0, 0]],
    joints="RP",
    limits=[[-1, 2], [0, 0.5]],
    links=["elbow", "slide"],
    name="arm",
)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([0.0], "q: expected shape (..., 2), got (1,)"),
        ([0.0, 0.0, 0.0], "q: expected shape (..., 2), got (3,)"),
        (0.0, "q: expected shape (..., 2), got ()"),
        ([0.0, np.nan], "q: nan at index (1,); every number must be finite"),
        ([[0.0, 0.0], [np.inf, 0.0]], "q: inf at index (1, 0)"),
        ("home", "q: expected numbers of shape (..., 2), got 'home'"),
        (None, "q: "),
    ],
)
@pytest.mark.parametrize("ask", ["fk", "frames", "jacobian", "coordinates"])
def test_coordinates_are_checked(ask, q, words):
    with pytest.raises(rs.errors.InputError) as caught:
        getattr(ARM, ask)(q)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([2.5, 0.0], "q: joint 'elbow' of 'arm' is 2.5 rad, outside its limits [-1, 2] rad"),
        ([0.0, -0.1], "q: joint 'slide' of 'arm' is -0.1 m, outside its limits [0, 0.5] m"),
        (
            [[0, 0], [0, 0], [0, 7]],
            "q of row (2,): joint 'slide' of 'arm' is 7 m, outside its limits [0, 0.5] m",
        ),
    ],
)
def test_a_coordinate_outside_its_limits_is_named_with_them(q, words):
    with pytest.raises(rs.errors.InputError) as caught:
        ARM.coordinates(q)
    assert str(caught.value) == words


def test_limits_themselves_are_inside_and_kinematics_works_beyond():
    close(ARM.coordinates([[-1, 0], [2, 0.5]]), [[-1, 0], [2, 0.5]], 0)
    close(ARM.coordinates([2 + 1e-10, 0]), [2 + 1e-10, 0], 0)  # rounding
    close(ARM.fk([np.pi, 2.0])[:3, 3], [-1, 0, 2], 1e-15)
    close(ARM.limits, [[-1, 2], [0, 0.5]], 0)
    assert ARM.coordinate_units == ("rad", "m")


def test_without_limits_there_are_none():
    robot = branching()
    assert robot.limits.shape == (robot.nq, 2)
    assert (robot.limits == [-np.inf, np.inf]).all()


def test_home_is_checked_too_and_read_only():
    with pytest.raises(
        rs.errors.InputError, match=r"arm.home: joint 'link1' of 'arm' is 3 rad, outside"
    ):
        rs.Robot.from_dh([[0, 0, 1, 0]], limits=[[-1, 2]], home=[3], name="arm")
    with pytest.raises(ValueError, match="read-only"):
        ARM.home[0] = 1.0


def test_a_quaternion_has_length_one():
    robot = branching()
    q = some_q(robot)
    q[4:8] *= 1.01
    with pytest.raises(rs.errors.InputError, match="q: the quaternion of 'c' must have length 1"):
        robot.fk(q)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: rs.joints.Joint("revolut"), "no joint kind 'revolut'; did you mean 'revolute'?"),
        (lambda: rs.joints.Joint("floating", limits=(0, 1)), "a floating joint has no limits"),
        (lambda: rs.joints.Joint("fixed", limits=(0, 1)), "a fixed joint has no limits"),
        (lambda: rs.joints.Joint("revolute", limits=(1, -1)), "limits must be (lowest, highest)"),
        (lambda: rs.joints.Joint("revolute", limits=(1, 1)), "limits must be (lowest, highest)"),
        (lambda: rs.joints.Joint("revolute", limits=(np.nan, 1)), "joint limits: nan at index"),
    ],
)
def test_joints_are_checked(make, words):
    with pytest.raises(rs.errors.InputError) as caught:
        make()
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rows": [[0, 0, 1]]}, "DH rows (theta, d, a, alpha): expected shape (..., n, 4), got"),
        ({"rows": []}, "DH rows"),
        ({"rows": np.empty((0, 4))}, "DH rows: expected shape (n, 4), got (0, 4)"),
        ({"rows": np.zeros((1, 2, 4))}, "DH rows: expected shape (n, 4), got (1, 2, 4)"),
        ({"rows": [[0, 0, np.nan, 0]] * 2}, "alpha): nan at index (0, 2)"),
        ({"convention": "craig"}, "must be 'standard' or 'modified', got 'craig'"),
        ({"joints": "R"}, "joints: expected 2 letters R or P, as in 'RR', got 'R'"),
        ({"joints": "RX"}, "joints: expected 2 letters R or P, as in 'RR', got 'RX'"),
        ({"joints": 2}, "joints: expected 2 letters R or P"),
        ({"limits": [[0, 1]]}, "limits: expected shape (..., 2, 2), got (1, 2)"),
        ({"limits": [[1, 0], [0, 1]]}, "limits must be (lowest, highest), got (1.0, 0.0)"),
        ({"links": ["a"]}, "2 DH rows need 2 link names"),
        ({"shapes": [[]]}, "2 DH rows need 2 link names and 3 lists of shapes"),
        ({"home": [0]}, "home: expected shape (..., 2), got (1,)"),
    ],
)
def test_a_dh_table_is_checked(change, words):
    with pytest.raises(rs.errors.InputError) as caught:
        rs.Robot.from_dh(**{"rows": [[0, 0, 1, 0], [0, 0, 1, 0]], **change})
    assert words in str(caught.value)
