"""Joints in the plane: held velocities are arcs, Jacobians their derivatives, unicycles roll."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

steady = settings(derandomize=True, max_examples=50, deadline=None)
seeds = st.integers(0, 2**32)
turns = st.one_of(st.just(0.0), st.floats(-20, 20), st.floats(-1e-6, 1e-6))


def moving(kind, rng=None):
    """A robot of one joint; at a random place and with a random tail if there is a generator."""
    poses = () if rng is None else [rs.Pose.exp(rng.normal(size=6)) for _ in range(2)]
    return rs.Robot(
        "cart",
        [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint(kind, *poses))],
    )


PLANAR, UNICYCLE = moving("planar"), moving("unicycle")


def close(a, b, tolerance=1e-13):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


# coordinates


def test_three_coordinates_and_two_or_three_velocities():
    for robot in (PLANAR, UNICYCLE):
        assert robot.coordinate_names == ("body.x", "body.y", "body.theta")
        assert robot.coordinate_units == ("m", "m", "rad")
        assert robot.nq == 3
        assert (robot.limits == [-np.inf, np.inf]).all()
        close(robot.home, [0, 0, 0], 0)
    assert PLANAR.velocity_names == ("body.vx", "body.vy", "body.omega")
    assert UNICYCLE.velocity_names == ("body.v", "body.omega")


@steady
@given(seeds, st.sampled_from(["planar", "unicycle"]))
def test_the_body_moves_in_the_plane_of_its_place(seed, kind):
    rng = np.random.default_rng(seed)
    robot, (x, y, theta) = moving(kind, rng), rng.normal(size=3)
    joint = robot.links[1].joint
    motion = rs.Pose.at(x, y, 0, rpy=(0, 0, theta))
    close(robot.fk([x, y, theta]), (joint.place @ motion @ joint.tail).matrix)


def test_velocities_agree_with_the_body_in_its_own_axes():
    c, s = np.cos(0.3), np.sin(0.3)
    columns = np.array([[c, s, 0, 0, 0, 0], [-s, c, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1]]).T
    close(PLANAR.jacobian([1, 2, 0.3]), columns, 1e-15)
    close(UNICYCLE.jacobian([1, 2, 0.3]), columns[:, [0, 2]], 1e-15)


# motion


@steady
@given(seeds, turns)
def test_a_held_velocity_is_the_exponential_of_its_twist(seed, turn):
    rng = np.random.default_rng(seed)
    q, (vx, vy), dt = rng.normal(size=3), rng.normal(size=2), rng.uniform(0.01, 2)
    after = PLANAR.integrate(q, [vx, vy, turn / dt], dt)
    moved = rs.Pose.exp([dt * vx, dt * vy, 0, 0, 0, turn])
    close(PLANAR.fk(after), PLANAR.fk(q) @ moved.matrix)
    assert after[2] == pytest.approx(q[2] + turn, abs=1e-14)  # not wrapped


@steady
@given(seeds, turns)
def test_a_unicycle_circles_about_a_point_on_its_axle(seed, turn):
    """The centre p + (v / omega) y does not move, and the way is as long as v dt."""
    rng = np.random.default_rng(seed)
    q, v, dt = rng.normal(size=3), rng.normal(), rng.uniform(0.01, 2)
    omega = np.copysign(max(abs(turn), 0.01), turn) / dt
    after = UNICYCLE.integrate(q, [v, omega], dt)
    centres = [p[:2] + v / omega * np.array([-np.sin(p[2]), np.cos(p[2])]) for p in (q, after)]
    close(*centres, 1e-12)
    chord = 2 * abs(v / omega * np.sin(omega * dt / 2))
    assert np.hypot(*(after - q)[:2]) == pytest.approx(chord, abs=1e-13)


def test_a_quarter_circle_and_a_straight_line():
    close(UNICYCLE.integrate([0, 0, 0], [np.pi / 2, np.pi / 2], 1.0), [1, 1, np.pi / 2], 1e-15)
    close(UNICYCLE.integrate([1, 2, np.pi / 2], [3.0, 0.0], 0.5), [1, 3.5, np.pi / 2], 1e-15)
    close(PLANAR.integrate([1, 2, np.pi / 2], [0.0, 3.0, 0.0], 0.5), [-0.5, 2, np.pi / 2], 1e-15)


@steady
@given(seeds, turns)
def test_a_unicycle_is_a_planar_joint_that_does_not_slide_sideways(seed, turn):
    q, v = np.random.default_rng(seed).normal(size=(2, 3))
    rolled = UNICYCLE.integrate(q, [v[0], turn], 0.3)
    np.testing.assert_array_equal(rolled, PLANAR.integrate(q, [v[0], 0.0, turn], 0.3))


@steady
@given(seeds, st.sampled_from([PLANAR, UNICYCLE]))
def test_two_half_steps_are_one_step_and_there_is_a_way_back(seed, robot):
    rng = np.random.default_rng(seed)
    q, v, dt = rng.normal(size=3), 3 * rng.normal(size=robot.nv), rng.uniform(0.01, 2)
    halves = robot.integrate(robot.integrate(q, v, dt / 2), v, dt / 2)
    close(halves, robot.integrate(q, v, dt))
    close(robot.integrate(halves, v, -dt), q)


@pytest.mark.parametrize("robot", [PLANAR, UNICYCLE, rs.robots.mobile_arm()], ids=lambda r: r.name)
def test_a_row_of_a_batch_has_the_bits_that_it_has_alone(robot):
    rng = np.random.default_rng(5)
    q, v = rng.normal(size=(7, robot.nq)), rng.normal(size=(7, robot.nv))
    whole = robot.integrate(q, v, 0.1), robot.fk(q), robot.jacobian(q)
    for i in range(7):
        alone = robot.integrate(q[i], v[i], 0.1), robot.fk(q[i]), robot.jacobian(q[i])
        for a, b in zip(whole, alone, strict=True):
            np.testing.assert_array_equal(a[i], b)


# Jacobians


def differences(robot, q, link, step):
    """(6, nv) central differences of position and rotation, in base axes."""
    columns = []
    for v in np.eye(robot.nv):
        ahead, behind = (robot.fk(robot.integrate(q, v, h), link) for h in (step, -step))
        turn = np.eye(4)
        turn[:3, :3] = ahead[:3, :3] @ behind[:3, :3].T
        columns.append(np.append(ahead[:3, 3] - behind[:3, 3], rs.Pose(turn).rotvec) / (2 * step))
    return np.stack(columns, axis=-1)


def rover(rng):
    """A unicycle on a planar joint, with an arm in between: nothing commutes."""
    plan = [("deck", "planar"), ("arm", "revolute"), ("rover", "unicycle"), ("mast", "revolute")]
    links = [rs.joints.Link("base")]
    for name, kind in plan:
        place, tail = (rs.Pose.exp(rng.normal(size=6)) for _ in range(2))
        links.append(rs.joints.Link(name, links[-1].name, rs.joints.Joint(kind, place, tail)))
    return rs.Robot("rover", links)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "make",
    [
        lambda rng: moving("planar", rng),
        lambda rng: moving("unicycle", rng),
        lambda rng: rs.robots.mobile_arm(),
        rover,
    ],
    ids=["planar", "unicycle", "mobile_arm", "rover"],
)
def test_jacobians_are_derivatives_of_second_order(make, seed):
    """Central differences miss by the square of the step: the slope in log-log is 2."""
    rng = np.random.default_rng(seed)
    robot, steps = make(rng), np.array([0.1, 0.05, 0.025])
    q, J = (q := rng.normal(size=robot.nq)), robot.jacobian(q)
    errors = np.array([np.abs(differences(robot, q, None, h) - J).max() for h in steps])
    assert (np.abs(np.diff(np.log(errors)) / np.diff(np.log(steps)) - 2) < 0.05).all()
    assert errors[-1] < 1e-2


# the loop


def drives(robot, wall=3.0):
    """A base with a camera at its front that looks at eight marks on and before a wall."""
    corners = np.array([(y, z) for y in (-0.5, 0.5) for z in (-0.2, 0.4)])
    marks = [[wall, y, z + 0.4] for y, z in corners] + [[wall - 0.5, y, 0.5] for y, _ in corners]
    lens = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    eye = rs.MountedCamera("eye", lens, on=f"{robot.name}.camera_mount")
    return rs.Scene(robot, rs.Object("wall", marks=marks), eye)


@pytest.mark.filterwarnings("ignore:a unicycle cannot move sideways")
@pytest.mark.parametrize(
    ("name", "start"), [("holonomic_base", [-0.8, 0.3, 0.2]), ("unicycle", [-0.8, 0.0, 0.0])]
)
def test_a_base_drives_to_where_the_goal_was_shown(name, start):
    run = rs.simulate(drives(rs.robots.load(name)), rs.IBVS(gain=2.0), start, duration=20)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.CONVERGED
    close(run.q_end, [0, 0, 0], 1e-3)


@pytest.mark.filterwarnings("ignore:a unicycle cannot move sideways")
@pytest.mark.parametrize("name", ["holonomic_base", "unicycle"])
def test_each_step_is_the_arc_of_its_command(name):
    robot = rs.robots.load(name)
    starts = np.random.default_rng(6).uniform(-0.2, 0.2, (4, 3)) - [0.5, 0, 0]
    noisy = rs.Sensing(noise=0.2)
    run = rs.simulate(drives(robot), rs.IBVS(), starts, duration=1.0, sensing=noisy).isel(run=2)
    after = robot.integrate(run.q.values[:-1], run.qd.values[:-1], 0.04)
    close(after, run.q.values[1:], 1e-15)


# what cannot be


@pytest.mark.parametrize("kind", ["planar", "unicycle"])
def test_wrong_numbers_are_reported(kind):
    robot = moving(kind)
    with pytest.raises(rs.errors.InputError, match=f"a {kind} joint has no limits, got \\(0, 1\\)"):
        rs.joints.Joint(kind, limits=(0, 1))
    for wrong in ([0, 0], [0, 0, 0, 0]):
        with pytest.raises(rs.errors.InputError, match=r"q: expected shape \(..., 3\), got"):
            robot.fk(wrong)
    with pytest.raises(
        rs.errors.InputError, match=rf"v: expected shape \(..., {robot.nv}\), got \(4,\)"
    ):
        robot.integrate([0, 0, 0], [0, 0, 0, 0], 0.1)
    with pytest.raises(rs.errors.InputError, match=r"q: nan at index \(2,\)"):
        robot.fk([0, 0, np.nan])


def test_a_pose_is_not_taken_where_seven_coordinates_are_none():
    """A unicycle with four revolute joints has the 7 coordinates and 6 velocities of a flight."""
    arm = rs.Robot.from_dh([[0, 0, 1, 0]] * 4).links
    robot = rs.Robot("rover", [*UNICYCLE.links, rs.joints.Link("deck", "body"), *(
        rs.joints.Link(k.name, "deck" if k.parent == "base" else k.parent, k.joint) for k in arm[1:]
    )])  # fmt: skip
    assert (robot.nq, robot.nv) == (7, 6)
    with pytest.raises(rs.errors.InputError, match=r"q: expected"):
        robot.fk(rs.Pose.at(0, 0, 0))
