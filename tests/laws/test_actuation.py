"""Each imperfection of the joints has an effect of known size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.kernels.bodies.actuator_response import follow_commands, quantise_encoders
from robsim.kernels.machine.program import evaluate_stages

INF = np.inf


def followed(u, v, lag, limit, rate, dt):
    """Velocity after dt, and its mean."""

    def add(program, command, v):
        mean = program.rows()
        own = {"limits": program.constant([limit]), "rates": program.constant([rate])}
        given = {"dt": program.constant(dt), "lag": program.constant(lag), **own}
        program.add(follow_commands, **given, each=[(command, v, mean)])
        return v, mean

    v, mean = evaluate_stages(add, [np.array([u]), np.array([v])], [(), ()])
    return v[0], mean[0]


def integrated(u, v, lag, limit, rate, dt, steps):
    """The same by the midpoint rule of the differential equation."""
    goal, h, way = np.clip(u, -limit, limit), dt / steps, 0.0

    def slope(v):
        return np.clip((goal - v) / lag, -rate, rate)

    for _ in range(steps):
        middle = v + 0.5 * h * slope(v)
        way += h * middle
        v += h * slope(middle)
    return v, way / dt


@pytest.mark.full
@settings(max_examples=60, derandomize=True, deadline=None)
@given(
    st.floats(-3, 3), st.floats(-3, 3), st.floats(0.02, 1), st.floats(0.5, 4), st.floats(0.5, 50)
)
def test_the_response_agrees_with_the_differential_equation(u, v, lag, limit, rate):
    """The midpoint rule errs by h^2, also at the bend of the slope at the end of the ramp."""
    exact, rough = (
        followed(u, v, lag, limit, rate, 0.3),
        integrated(u, v, lag, limit, rate, 0.3, 3000),
    )
    np.testing.assert_allclose(exact, rough, rtol=0, atol=2e-5)


@pytest.mark.parametrize("t", [1e-6, 0.01, 0.3, 5.0])
def test_a_lag_alone_is_an_exponential(t):
    tau = 0.2
    after, mean = followed(1.5, -0.5, tau, INF, INF, t)
    np.testing.assert_allclose(after, 1.5 - 2.0 * np.exp(-t / tau), rtol=1e-15)
    np.testing.assert_allclose(mean, 1.5 + 2.0 * tau * np.expm1(-t / tau) / t, rtol=1e-12)


def test_an_acceleration_alone_is_a_ramp_and_then_the_command():
    assert followed(1.0, 0.0, 0.0, INF, 4.0, 0.1) == pytest.approx((0.4, 0.2), abs=1e-15)
    assert followed(1.0, 0.0, 0.0, INF, 4.0, 0.5) == pytest.approx((1.0, 0.75), abs=1e-15)
    assert followed(-1.0, 1.0, 0.0, 0.5, 4.0, 1.0)[0] == -0.5


def test_without_limits_the_command_is_followed_at_once():
    assert followed(0.7, -2.0, 0.0, INF, INF, 0.04) == (0.7, pytest.approx(0.7, rel=1e-15))


@pytest.fixture
def arm():
    """A camera on a planar arm that looks down on three points."""
    robot = rs.robots.planar_2r()
    eye = rs.MountedCamera(
        "eye", rs.Camera(np.eye(3)), f"{robot.name}.fore", rs.Pose.at(rpy=(np.pi, 0, 0))
    )
    x, y, _ = robot.fk(robot.home + 0.2)[:3, 3]
    marks = np.add([[0.1, 0, 0], [-0.1, 0.1, 0], [0, -0.1, 0]], [x, y, -1.0])
    return rs.Scene([robot], [rs.Object("dots", marks=marks)], [eye])


def closed(scene, **actuation):
    q0 = np.add(scene.home, [0.4, 0.5])
    task = rs.IBVS(scene.home + 0.2, gain=1.0)
    return rs.simulate(
        scene, task, q0, dt=0.02, duration=2.0, actuation=rs.Actuation(**actuation), hold=True
    )


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_the_joints_move_as_the_response_predicts(arm):
    """q moves by the mean, and qd_actual is the velocity, of each period."""
    options = {"lag": 0.05, "velocity": 0.3, "acceleration": 1.5}
    run = closed(arm, **options)
    q, qd, v = run.q.values, run.qd.values, run.qd_actual.values
    np.testing.assert_array_equal(v[0], 0.0)
    for k in range(len(q) - 1):
        for j in range(2):
            after, mean = followed(qd[k, j], v[k, j], 0.05, 0.3, 1.5, 0.02)
            assert v[k + 1, j] == after
            assert q[k + 1, j] == pytest.approx(q[k, j] + 0.02 * mean, abs=1e-15)
    assert np.abs(v).max() <= 0.3 and np.abs(np.diff(v, axis=0)).max() <= 1.5 * 0.02 + 1e-12
    assert np.abs(qd).max() > 0.3  # the command was larger


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_limits_that_are_never_reached_change_nothing(arm):
    plain, loose = closed(arm), closed(arm, velocity=1e9, acceleration=1e15)
    np.testing.assert_allclose(loose.q.values, plain.q.values, rtol=0, atol=1e-12)
    assert "qd_actual" not in plain


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_a_joint_has_its_own_limit(arm):
    run = closed(arm, velocity=[0.1, 0.4])
    top = np.abs(run.qd_actual.values).max(axis=0)
    np.testing.assert_allclose(top, [0.1, 0.4])


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_the_camera_velocity_agrees_with_the_joints_not_with_the_command(arm):
    run = closed(arm, lag=0.2)
    robot = arm.robot()
    for k in (0, 5, 50):
        J = robot.jacobian(run.q.values[k], "fore")
        speed = np.linalg.norm(J[:3] @ run.qd_actual.values[k])
        assert np.linalg.norm(run.camera_velocity.values[k, :3]) == pytest.approx(speed, abs=1e-12)


class Seen:
    """A law that keeps the state of the joints that it receives."""

    def __init__(self):
        self.q = []

    def command(self, state):
        self.q.append(state.q.copy())
        return np.full((len(state.q), 2), 0.3)


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_encoders_count_in_whole_steps_and_err_by_half_of_one(arm):
    law, step = Seen(), 0.01
    run = rs.simulate(
        arm,
        rs.IBVS(arm.home, law=law),
        np.add(arm.home, [0.013, -0.007]),
        dt=0.02,
        duration=1.0,
        actuation=rs.Actuation(encoder=[step, 0.0]),
        hold=True,
    )
    told, true = np.concatenate(law.q), run.q.values
    np.testing.assert_array_equal(told[:, 1], true[:, 1])  # its step is zero
    np.testing.assert_allclose(told[:, 0] / step, np.round(told[:, 0] / step), atol=1e-9)
    assert 0.4 * step < np.abs(told[:, 0] - true[:, 0]).max() <= 0.5 * step + 1e-12


def quantise(steps, q):
    def add(program, rows):
        out = program.rows(len(q))
        program.add(quantise_encoders, steps=program.constant(steps), q=rows, out=out)
        return (out,)

    return evaluate_stages(add, [q], [(len(q),)])[0]


def test_a_count_is_the_nearest_one():
    far = 2.0**80  # more than an integer of 64 bits has room for
    q = np.array([[0.24, 0.26, -0.8, far, np.nan], [0.1, 0.2, 0.3, far, np.nan]])
    found = quantise([0.5, 0.0], q)
    np.testing.assert_array_equal(found, [[0.0, 0.5, -1.0, far, np.nan], q[1]])


@pytest.mark.parametrize("step", [1e-320, 1e-20, 1e-14, 1.0, 1e6])
def test_steps_too_small_or_numbers_too_large_to_count_change_nothing(step):
    q = np.array([[1e300, -1e25, np.inf, -np.inf, np.nan, 320.25 if step < 1e-13 else 0.0]])
    np.testing.assert_array_equal(quantise([step], q), q)


def test_a_unicycle_that_lags_is_moved_by_its_mean_velocity_and_an_arm_exactly(after):
    """Against steps of a hundredth; the error of a mean velocity falls with the third power."""
    dt = 0.04
    for robot, exact in ((rs.robots.unicycle(), False), (rs.robots.rhino_xr4(), True)):
        scene = rs.Scene(robot)
        errors = [_error(after, scene, h) for h in (dt, dt / 2)]
        if exact:
            assert max(errors) < 1e-13
        else:
            assert np.log2(errors[0] / errors[1]) == pytest.approx(3, abs=0.3)


def _error(after, scene, dt, parts=100):
    q, v, lag = scene.home, -np.ones(scene.nv), rs.Actuation(lag=0.1)
    command = np.linspace(-2, 3, scene.nv)
    whole, _ = after(scene, q, v, command, dt, actuation=lag)
    for _ in range(parts):
        q, v = after(scene, q, v, command, dt / parts, actuation=lag)
    return np.abs(whole - q).max()


@pytest.mark.parametrize(
    ("made", "words"),
    [
        ({"lag": -1}, "Actuation.lag must be a number (s) not below 0, got -1"),
        ({"lag": [1, 2]}, "Actuation.lag must be a number (s) not below 0"),
        ({"velocity": 0}, "Actuation.velocity must be a positive number, or one for each"),
        ({"acceleration": [1, -2]}, "Actuation.acceleration must be a positive number, or"),
        ({"encoder": -0.1}, "Actuation.encoder must be a number not below 0, or one for"),
        ({"velocity": "fast"}, "Actuation.velocity: expected a number, got 'fast'"),
        ({"encoder": np.nan}, "Actuation.encoder: nan"),
    ],
)
def test_contradictory_values_are_refused(made, words):
    with pytest.raises(rs.errors.InputError) as error:
        rs.Actuation(**made)
    assert words in str(error.value)
