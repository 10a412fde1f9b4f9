"""Vehicles that servo: they drive arcs, steer as they can, and their wheels do not slip."""

import numpy as np
import pytest

import robsim as rs
from robsim import Motion, Pose
from robsim.errors import InputError
from robsim.joints import Steering

WHEELS = {
    "car": ("rear_left", "rear_right", "front_left", "front_right"),
    "differential_drive": ("wheel_left", "wheel_right"),
}


def close(a, b, tolerance=1e-13):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


@pytest.fixture(scope="module", params=WHEELS)
def driven(request):
    """A robot, all states of its run up to a sign, and its velocities in each state."""
    scenario = rs.load_scenario(rs.examples.path(request.param))
    run = scenario.run()
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
    q = run.q.dropna("time").values
    done = run.qd_actual.values[1 : len(q)] if "qd_actual" in run else run.qd.values[: len(q) - 1]
    return scenario.scene.robot(), q, done, scenario.dt


def test_its_path_is_a_chain_of_arcs(driven):
    """x' = x + R (sin theta' - sin theta), y' = y - R (cos theta' - cos theta), R = v/omega."""
    _, q, v, dt = driven
    (x, y, a), (X, Y, A) = q[:-1, :3].T, q[1:, :3].T
    speed, turn = v.T
    close(A - a, turn * dt, 1e-15)
    bent = np.abs(turn) > 1e-3  # elsewhere R is large, and its rounding too
    R = speed[bent] / turn[bent]
    close((X - x)[bent], R * (np.sin(A) - np.sin(a))[bent], 1e-12)
    close((Y - y)[bent], -R * (np.cos(A) - np.cos(a))[bent], 1e-12)
    assert bent.sum() > 50


def test_no_wheel_slips_from_start_to_end(driven):
    """Points that touch the floor stand still there, at the end of each period."""
    robot, q, v, _ = driven
    for wheel in WHEELS[robot.name]:
        radius = robot.fk(robot.home, wheel)[2, 3]
        twist = np.einsum("tij,tj->ti", robot.jacobian(q[1:], wheel), v)
        close(twist[:, :3] + np.cross(twist[:, 3:], [0, 0, -radius]), 0)


def test_each_wheel_turns_by_the_way_of_its_hub(driven):
    """Arc = chord (half a turn)/sin(half a turn), of the hub's places at two instants."""
    robot, q, _, _ = driven
    half = 0.5 * np.diff(q[:, 2])
    for wheel in WHEELS[robot.name]:
        hub, i = robot.fk(q, wheel), robot.coordinate_names.index(wheel)
        arc = np.linalg.norm(np.diff(hub[:, :3, 3], axis=0), axis=1) / np.sinc(half / np.pi)
        forward = hub[0, 2, 3] * np.diff(q[:, i])
        close(np.abs(forward), arc, 1e-12)
        assert (forward > 0).sum() > 100


def test_a_wheel_in_a_figure_has_turned(driven):
    """Its spoke is drawn at its angle: at a quarter turn it stands."""
    robot, *_ = driven
    q, wheel = robot.home.copy(), WHEELS[robot.name][0]
    q[robot.coordinate_names.index(wheel)] = np.pi / 2
    link = next(link for link in robot.links if link.name == wheel)
    lying, standing = (
        np.ptp(link.shapes[1].at(robot.fk(state, wheel)).vertices, axis=0)
        for state in (robot.home, q)
    )
    close(standing, lying[[2, 1, 0]], 1e-15)
    assert lying[0] > 4 * lying[2]


def test_a_car_steers_within_its_rate_and_limit_at_every_step():
    scenario = rs.load_scenario(rs.examples.path("car"), ["task.tasks.0.gain=0.5"])
    run, car = scenario.run(), scenario.scene.robot()
    steering, dt = car.links[1].joint.steering, scenario.dt
    angle = run.q.values[:, 3]
    steps = np.abs(np.diff(angle))
    assert steps.max() == pytest.approx(steering.rate * dt, abs=1e-15)  # from the left to the right
    assert np.abs(angle).max() == steering.limit and angle[-1] == -steering.limit
    speed, turn = run.qd_actual.values.T
    close(turn, speed * np.tan(angle) / steering.wheelbase, 1e-15)
    np.testing.assert_array_equal(speed[1:], run.qd.values[:-1, 0])
    wanted = np.arctan(steering.wheelbase * run.qd.values[:-1, 1] / run.qd.values[:-1, 0])
    free = (np.abs(wanted - angle[:-1]) < steering.rate * dt) & (np.abs(wanted) < steering.limit)
    close(angle[1:][free], wanted[free], 1e-15)
    assert 10 < free.sum() < free.size
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.TIME_LIMIT
    assert run.error.values[-1, 0] > 0.02  # metres to the side of the sign: it cannot turn more


def test_the_error_of_a_differential_drive_decays_by_the_law():
    """e = e(0) exp(-gain t) as the period goes to zero, to first order in it."""
    scenario = rs.load_scenario(rs.examples.path("differential_drive"))
    missed = []
    for dt in (0.02, 0.01):
        run = scenario.run(dt=dt, duration=4.0)
        law = run.error.values[0] * np.exp(-run.time.values[:, None])
        missed.append(np.abs(run.error.values - law).max())
    assert missed[0] < 0.01 * np.abs(run.error.values[0]).max()
    assert missed[0] / missed[1] == pytest.approx(2.0, abs=0.1)


# the commanded velocity


def watched(rates, duration=3.0, dt=0.04):
    """A car on its own way, and a head that looks after it; the car's part of the run."""
    car = rs.robots.car().at(Pose.at(3, -1, 0))
    lamp = rs.Object("lamp", marks=[[0, 0, 0.4]], on="car.body")
    eye = rs.MountedCamera("eye", rs.Camera([[800, 0, 0], [0, 800, 0], [0, 0, 1]]), "pan_tilt.head")
    scene = rs.Scene([rs.robots.pan_tilt(), car], [lamp], [eye], [Motion("car", rates)])
    task = rs.IBVS(rs.GoalFeatures([0.0, 0.0]), depth=3.0)
    run = rs.simulate(scene, task, dt=dt, duration=duration, hold=True)
    return run.q.values[:, 2:], run.qd_actual.values[:, 2:]


def test_a_car_is_commanded_by_its_speed_and_steering_angle():
    """If the commanded angle changes slowly, the wheels have it at the end of each period."""
    steering = rs.robots.car().links[1].joint.steering
    q, v = watched(lambda t: steering.rates(0.5, 0.4 * np.sin(t)))
    close(q[1:, 3], 0.4 * np.sin(0.04 * np.arange(len(q) - 1)), 1e-15)
    close(v[:, 1], v[:, 0] * np.tan(q[:, 3]) / steering.wheelbase, 1e-15)
    close(np.diff(q[:, 2]), 0.04 * 0.5 * np.tan(q[1:, 3]) / steering.wheelbase, 1e-15)


def test_a_car_that_is_commanded_to_turn_at_once_takes_its_time():
    steering = rs.robots.car().links[1].joint.steering
    q, v = watched(steering.rates(0.5, 0.4), duration=0.4)
    close(q[:, 3], np.minimum(3.2 * 0.04 * np.arange(len(q)), 0.4), 1e-15)
    close(v[:, 1], 0.5 * np.tan(q[:, 3]) / steering.wheelbase, 1e-15)


def test_rates_of_a_steering_angle():
    steering = Steering(0.5, limit=0.6)
    rates = steering.rates([1.0, -2.0], [[0.3], [0.6]])
    assert rates.shape == (2, 2, 2)
    close(np.arctan(0.5 * rates[..., 1] / rates[..., 0]), [[0.3, 0.3], [0.6, 0.6]], 1e-15)
    with pytest.raises(InputError, match=r"steering angle -0.7 rad: the limit is 0.6 rad"):
        steering.rates(1.0, [0.1, -0.7])
    with pytest.raises(InputError, match="speed"):
        steering.rates("fast", 0.1)


# between two instants


def hold_command(scene, car_angle=0.0):
    """Coordinates, velocities, and commands."""
    q = scene.home.copy()
    q[3] = car_angle
    v = np.random.default_rng(4).normal(size=scene.nv)
    v[:2] = 1.0, 2.0
    return q, 0.5 * v, v


def test_in_the_middle_of_a_period_a_car_is_on_its_arc(after):
    """It steers once, when the period begins: a late image shows it on the way that it went."""
    scene = rs.Scene(rs.robots.car())
    whole, v = after(scene, *hold_command(scene), 0.04)
    half, _ = after(scene, *hold_command(scene), 0.04, 0.02)
    assert whole[3] == half[3] == pytest.approx(3.2 * 0.04)
    rest = scene.robot().integrate(half, [1.0, v[1]], 0.02)
    close(rest, whole, 1e-15)


def test_an_arm_lags_no_differently_beside_a_car(after):
    arm, car = rs.robots.rhino_xr4(), rs.robots.car()
    together, actuation = rs.Scene([car, arm]), rs.Actuation(lag=0.1, acceleration=9.0)
    whole = hold_command(together)
    alone = tuple(part[-5:] for part in whole)
    both = after(together, *whole, 0.04, actuation=actuation)
    own = after(rs.Scene(arm), *alone, 0.04, actuation=actuation)
    for mine, theirs in zip(own, both, strict=True):
        np.testing.assert_array_equal(mine, theirs[-5:])
    q, v = both
    assert 0.5 < v[0] < 1.0  # between the start and the commanded velocity
    close(v[1], v[0] * np.tan(q[3]) / 0.3302, 1e-15)


# base and arm at once


@pytest.mark.parametrize("base", ["differential_drive", "car"])
def test_base_and_arm_servo_as_one_robot(base):
    """One Jacobian for both: they share the way, and the camera gets to its pose."""
    carrier = rs.robots.load(base)
    robot = carrier.with_tool(rs.robots.puma560(), Pose.at(0, 0, 0.2), on="body")
    camera = rs.Camera([[500, 0, 400], [0, 500, 400], [0, 0, 1]])
    T = robot.fk(robot.home)
    plate = rs.Object(
        "plate",
        marks=[[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.08, 0], [-0.1, 0.1, 0]],
        pose=Pose(T) @ Pose.at(0, 0, 0.5, rpy=(0.1, 0, 0.2)),
    )
    scene = rs.Scene([robot], [plate], [rs.MountedCamera("eye", camera, f"{base}.flange")])
    q0 = robot.home.copy()
    q0[:3] = -0.2, 0.05, 0.1
    q0[-6:] += [0.1, -0.05, 0.1, 0.05, -0.1, 0.1]
    run = rs.simulate(scene, rs.PBVS(), q0, duration=20.0)
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
    close(run.camera_pose.dropna("time").values[-1], T, 2e-5)
    moved = np.abs(run.q_end.values - q0)
    assert moved[0] > 0.02 and moved[-6:].max() > 0.05


def test_a_car_is_warned_of_as_a_car():
    scene = rs.load_scenario(rs.examples.path("car")).scene
    with pytest.warns(
        rs.errors.RankWarning, match="a car cannot move sideways.*use no more features"
    ):
        rs.IBVS().bind(scene)
    with pytest.raises(InputError, match="docking is for a camera that rides on a unicycle"):
        rs.Docking().bind(scene)
