"""Joints that drives move by torques, against closed forms and an integration by SciPy."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robsim as rs
from robsim.joints import Joint, Link, Mimic
from robsim.shapes import Inertia

MASS, LENGTH, CENTRE, MOMENT, ARMATURE = 2.0, 0.5, 0.25, 0.05, 0.1
G = 9.81
UPRIGHT = rs.Pose.at(rpy=(np.pi / 2, 0, 0))  # positive angles raise the links


def build_lift(friction=0.0, damping=0.0, effort=None, mass=2.0):
    """A mass on a vertical prismatic joint."""
    joint = Joint("prismatic", friction=friction, damping=damping, effort=effort)
    body = Inertia(mass, tensor=np.eye(3) * 1e-3)
    return rs.Robot("lift", [Link("base"), Link("cage", "base", joint, inertia=body)])


def build_pendulum(**more):
    """A vertical arm with two equal links."""
    inertia = Inertia(MASS, (CENTRE, 0, 0), np.diag([0.0, MOMENT, MOMENT]))
    first = Joint("revolute", place=UPRIGHT, armature=ARMATURE, **more)
    second = Joint("revolute", place=rs.Pose.at(LENGTH, 0, 0), armature=ARMATURE, **more)
    links = [
        Link("base"),
        Link("upper", "base", first, inertia=inertia),
        Link("fore", "upper", second, inertia=inertia),
        Link("tip", "fore", Joint(place=rs.Pose.at(LENGTH, 0, 0))),
    ]
    return rs.Robot("arm", links, home=[0.5, -0.7])


def hold(robot, drive, duration=1.0, q=None, dt=0.01, step=1e-3, **more):
    """Simulate a robot that is commanded to stay where it is."""
    task = rs.FollowJoints(by=dict.fromkeys(robot.coordinate_names, 0.0), gain=1e-9, duration=0.1)
    actuation = rs.Actuation(drive=drive, step=step, **more)
    start = robot.home if q is None else q
    settings = {"dt": dt, "duration": duration, "hold": True, "actuation": actuation}
    return rs.simulate(rs.Scene([robot]), task, start, **settings)


@dataclass(frozen=True)
class Force:
    """A user's drive with constant torques, and a torque per velocity."""

    value: tuple
    gain: float = 0.0

    def torque(self, state):
        return np.broadcast_to(self.value, state.v.shape) + self.gain * state.v


def pendulum_acceleration(q, v, tau):
    """Accelerations of the arm in closed form (Craig, Introduction to Robotics, section 6.7)."""
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    a = MOMENT + MASS * CENTRE**2
    m22 = a + ARMATURE
    m12 = a + MASS * LENGTH * CENTRE * c2
    m11 = 2 * a + MASS * LENGTH**2 + 2 * MASS * LENGTH * CENTRE * c2 + ARMATURE
    h = MASS * LENGTH * CENTRE * s2
    weight = MASS * G * CENTRE
    g2 = weight * np.cos(q[0] + q[1])
    g1 = g2 + (weight + MASS * G * LENGTH) * np.cos(q[0])
    bias = np.array([-h * (2 * v[0] * v[1] + v[1] ** 2), h * v[0] ** 2])
    M = np.array([[m11, m12], [m12, m22]])
    return np.linalg.solve(M, tau - bias - np.array([g1, g2])), (M, np.array([g1, g2]))


def integrate_velocity_loop(robot, bandwidth, rate, seconds):
    """Integrate the arm under velocity loops that hold it, with SciPy, without compensation."""
    _, (M, load) = pendulum_acceleration(robot.home, np.zeros(2), np.zeros(2))
    k = bandwidth * np.diag(M)
    push = np.array([3.0, -2.0])

    def slope(t, x):
        q, v, z = x[:2], x[2:4], x[4:]
        tau = -k * v + k * rate * z + push - 0.5 * v
        return np.concatenate([v, pendulum_acceleration(q, v, tau)[0], -v])

    x0 = np.concatenate([robot.home, np.zeros(2), load / (k * rate)])
    return solve_ivp(slope, (0.0, seconds), x0, rtol=1e-11, atol=1e-12).y[:, -1]


@dataclass(frozen=True)
class Pushed(rs.drives.VelocityLoop):
    """A velocity loop with constant torques beside it."""

    def bind(self, rows, runs):
        from robsim.kernels.dynamics.joint_drives import add_torques

        push, add = rows.program.constant([3.0, -2.0]), super().bind(rows, runs)

        def add_both():
            add()
            rows.program.add(add_torques, more=push, torque=rows.torque)

        return add_both


def test_a_velocity_loop_converges_to_an_integration_of_the_closed_form():
    robot = build_pendulum(damping=0.5)
    drive = Pushed(bandwidth=20.0, integral_rate=5.0, gravity=False)
    truth = integrate_velocity_loop(robot, 20.0, 5.0, 0.5)
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        run = hold(robot, drive, 0.5, step=step)
        errors.append(np.abs(run.q.values[-1] - truth[:2]).max())
    assert errors[0] < 3e-3
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.05)  # first order


def test_the_integral_holds_the_weight_from_the_start():
    robot = build_pendulum()
    _, (_, load) = pendulum_acceleration(robot.home, np.zeros(2), np.zeros(2))
    run = hold(robot, rs.drives.VelocityLoop(gravity=False), 1.0)
    np.testing.assert_allclose(run.q.values, np.tile(robot.home, (101, 1)), atol=1e-9)
    np.testing.assert_allclose(run.torque.values, np.tile(load, (101, 1)), rtol=1e-9)


def test_a_joint_at_rest_is_held_by_friction_exactly():
    robot = build_lift(friction=2.5 * G)
    run = hold(robot, Force((0.0,)), 10.0)
    assert np.all(run.q.values == robot.home)
    assert np.all(run.qd_actual.values == 0.0)


def test_a_joint_slides_and_stops_under_coulomb_friction():
    friction, mass, pulse = 15.0, 2.0, 0.5
    robot = build_lift(friction=friction, mass=mass)

    @dataclass(frozen=True)
    class Pulse:
        def torque(self, state):
            push = 24.0 if state.seconds < pulse - 1e-9 else 0.0
            return np.full(state.v.shape, mass * G + push)

    run = hold(robot, Pulse(), 1.5, step=1e-4)
    speed = (24.0 - friction) / mass * pulse
    way = 0.5 * speed * pulse + 0.5 * speed**2 / (friction / mass)
    assert abs(run.q.values[-1, 0] - way) < 2e-3 * way
    v = run.qd_actual.values[:, 0]
    stop = pulse + speed / (friction / mass)
    assert np.all(v[run.time.values > stop + 0.01] == 0.0)
    assert abs(v.max() - speed) < 2e-3 * speed


def test_gravity_is_a_number_of_the_actuation():
    moon = (0.0, 0.0, -1.62)
    drive = rs.drives.VelocityLoop(bandwidth=50.0, integral_rate=0.0, gravity=False)
    run = hold(build_lift(), drive, 1.0, gravity=moon)
    np.testing.assert_allclose(run.qd_actual.values[-1], -1.62 / 50.0, rtol=1e-9)


def test_a_proportional_loop_sags_at_the_velocity_of_its_load():
    robot = build_lift(mass=2.0)
    drive = rs.drives.VelocityLoop(bandwidth=50.0, integral_rate=0.0, gravity=False)
    run = hold(robot, drive, 1.0)
    np.testing.assert_allclose(run.qd_actual.values[-1], -G / 50.0, rtol=1e-9)
    assert hold(robot, replace(drive, gravity=True), 1.0).q.values[-1, 0] == 0.0


@pytest.mark.parametrize("known", [False, True])
def test_a_payload_sinks_until_the_stiffness_holds_it(known):
    robot = build_lift(mass=2.0)
    model = rs.drives.DriveModel(payload=known)
    drive = rs.drives.GravityCompensatedPD(frequency=20.0, model=model)
    load = rs.drives.Payload("lift.cage", mass=0.5, attached=0.2, released=2.2)
    run = hold(robot, drive, 4.0, payloads=[load])
    sag = 0.0 if known else 0.5 * G / (2.0 * 20.0**2)
    z = run.q.values[:, 0]
    assert np.all(z[:21] == 0.0)
    np.testing.assert_allclose(z[219], -sag, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(z[-1], 0.0, atol=1e-9)


def test_computed_torque_makes_all_joints_alike():
    """The error of every joint obeys e'' + 2 z w e' + w^2 e = 0, whatever the inertias."""
    robot, w, z = build_pendulum(), 30.0, 0.5
    task = rs.FollowJoints(by={"upper": 0.4, "fore": -0.6}, gain=1e-9, duration=0.5)
    drive = rs.drives.ComputedTorque(frequency=w, damping_ratio=z)
    runs = [
        rs.simulate(
            rs.Scene([robot]),
            task,
            dt=0.01,
            duration=0.4,
            actuation=rs.Actuation(drive=drive, step=step),
        )
        for step in (1e-3, 2.5e-4)
    ]
    for run in runs:
        moved = (run.q.values - robot.home)[1:] / [0.4, -0.6]
        np.testing.assert_allclose(moved[:, 0], moved[:, 1], atol=2e-3)
    wrong = replace(drive, model=rs.drives.DriveModel(mass=0.5))
    run = rs.simulate(
        rs.Scene([robot]), task, dt=0.01, duration=0.4, actuation=rs.Actuation(drive=wrong)
    )
    moved = (run.q.values - robot.home)[1:] / [0.4, -0.6]
    assert np.abs(moved[:, 0] - moved[:, 1]).max() > 0.05


def test_torques_are_limited_and_their_saturation_is_recorded():
    robot = build_lift(effort=30.0)
    run = hold(robot, Force((100.0,)), 0.1)
    assert np.all(run.torque.values[1:] == 30.0)
    np.testing.assert_allclose(run.saturation.values[1:], 1.0)
    np.testing.assert_allclose(run.qd_actual.values[-1], (15.0 - G) * 0.1, rtol=1e-9)
    run = hold(robot, rs.drives.VelocityLoop(torque_limit=25.0), 0.1)
    np.testing.assert_allclose(run.torque.values, 2.0 * G)
    assert np.all(run.saturation.values == 0.0)


def test_the_industrial_servo_holds_its_torques():
    """With a period of 10 ms, a velocity loop of 50 rad/s obeys v+ = v + 0.5 (u - v)."""
    robot = build_lift()
    servo = {"bandwidth": 50.0, "integral_rate": 0.0, "position_gain": 1e-6}
    drive = rs.drives.IndustrialServo(**servo, period=0.01)
    task = rs.FollowJoints(by={"cage": 1.0}, gain=1e-9, duration=1.0)
    actuation = rs.Actuation(drive=drive)
    run = rs.simulate(rs.Scene([robot]), task, dt=0.01, duration=0.5, actuation=actuation)
    v = np.zeros(51)
    for i in range(50):
        v[i + 1] = v[i] + 0.5 * (run.qd.values[i, 0] - v[i])
    np.testing.assert_allclose(run.qd_actual.values[:, 0], v, atol=1e-5)


def test_an_exploding_joint_ends_as_unstable_without_nan():
    run = hold(build_pendulum(), Force((1.0, 0.0), gain=200.0), 5.0)
    assert rs.Outcome(run.outcome.item()) is rs.Outcome.UNSTABLE
    end = float(run.end_time)
    assert 0.0 < end < 1.0
    steps = round(end / 0.01) + 1
    for name in ("q", "qd_actual", "torque"):
        assert np.isfinite(run[name].values[:steps]).all()
    assert np.isfinite(run.q_end.values).all()


def test_runs_are_the_same_alone_and_in_a_batch():
    robot = build_pendulum(friction=0.5, damping=0.2, effort=40.0)
    task = rs.FollowJoints(by={"upper": 0.4, "fore": -0.6}, duration=0.5)
    drive = rs.drives.VelocityLoop(bandwidth=40.0)
    load = rs.drives.Payload("arm.tip", mass=1.0, attached=0.1)
    experiment = rs.Experiment(
        rs.Scene([robot]),
        task,
        robot.home,
        dt=0.02,
        duration=1.0,
        actuation=rs.Actuation(drive=drive, payloads=[load]),
    )
    numbers = {
        "actuation.drive.bandwidth": np.linspace(20.0, 60.0, 11),
        "actuation.drive.model.mass": np.linspace(0.8, 1.2, 11),
        "actuation.payloads.0.mass": np.linspace(0.0, 2.0, 11),
    }
    together = experiment.with_(varied=numbers).run(threads=2, chunk=3)
    for i in range(11):
        alone = experiment.at({name: values[i] for name, values in numbers.items()}).run()
        for name in ("q", "torque", "saturation", "qd_actual"):
            np.testing.assert_array_equal(together[name].values[i], alone[name].values)


ERRORS = {
    "no inertias": (
        lambda: hold(rs.Robot.from_dh([[0, 0, 1, 0]], name="bare"), rs.drives.VelocityLoop()),
        "robot 'bare' has no inertias",
    ),
    "step": (
        lambda: hold(build_lift(), rs.drives.VelocityLoop(), step=3e-3),
        "actuation.step is 3 ms, which does not divide the control period of 10 ms",
    ),
    "period": (
        lambda: hold(build_lift(), rs.drives.IndustrialServo(period=0.003)),
        "actuation.drive: period is 3 ms",
    ),
    "limits": (
        lambda: hold(build_lift(), rs.drives.VelocityLoop(torque_limit=[1.0, 2.0])),
        "actuation.drive.torque_limit: 2 numbers for 1 driven joints: cage",
    ),
    "gain": (lambda: rs.drives.VelocityLoop(bandwidth=-1.0), "VelocityLoop.bandwidth"),
    "lag": (lambda: rs.Actuation(drive=rs.drives.VelocityLoop(), lag=0.1), "a drive and lag"),
    "frame": (
        lambda: hold(
            build_lift(),
            rs.drives.VelocityLoop(),
            payloads=[rs.drives.Payload("lift.cag", mass=1.0)],
        ),
        "no frame 'lift.cag'",
    ),
    "idle payload": (
        lambda: hold(
            build_lift(),
            rs.drives.VelocityLoop(),
            payloads=[rs.drives.Payload("lift.base", mass=1.0)],
        ),
        "no driven joint moves the frame 'lift.base'",
    ),
    "released": (
        lambda: rs.drives.Payload("lift.cage", mass=1.0, attached=2.0, released=1.0),
        "released at 1 s, expected a time after 2 s",
    ),
    "payload alone": (
        lambda: hold(build_lift(), None, payloads=[rs.drives.Payload("lift.cage", mass=1.0)]),
        "actuation: payloads and step: given without a drive",
    ),
    "no method": (lambda: rs.Actuation(drive=object()), "drive"),
    "shape": (lambda: hold(build_lift(), Wrong()), "Wrong.torque: expected shape"),
    "massless": (
        lambda: hold(
            rs.Robot("lift", [*build_lift().links, Link("wrist", "cage", Joint("revolute"))]),
            rs.drives.VelocityLoop(),
        ),
        "joint 'wrist' of 'lift' moves no mass",
    ),
}


class Wrong:
    def torque(self, state):
        return np.zeros(3)


@pytest.mark.parametrize("case", ERRORS)
def test_wrong_drives_are_refused_by_name(case):
    make, message = ERRORS[case]
    with pytest.raises(rs.errors.InputError, match=message.replace("(", r"\(")):
        make()


def test_a_joint_on_a_turning_vehicle_is_flung_outward():
    """A free slide on a vehicle that turns at w obeys r'' = w^2 r, so r = r0 cosh(w t)."""
    w, r0 = 1.5, 0.3
    base = rs.Robot("cart", [Link("ground"), Link("body", "ground", Joint("unicycle"))])
    along = Joint("prismatic", place=rs.Pose.at(rpy=(0, np.pi / 2, 0)))  # along x of the cart
    body = Inertia(1.0, tensor=np.eye(3) * 1e-3)
    slide = rs.Robot(
        "slide", [Link("rail"), Link("bead", "rail", along, inertia=body)], on="cart.body"
    )
    scene = rs.Scene([base, slide], motions=[rs.Motion("cart", rates=[0.0, w])])
    task = rs.FollowJoints(by={"bead": 0.0}, gain=1e-9, duration=0.1)
    errors = []
    for dt in (0.01, 0.005):
        run = rs.simulate(
            scene,
            task,
            {"cart": [0.4, -0.2, 0.3], "slide": [r0]},
            dt=dt,
            duration=0.6,
            hold=True,
            actuation=rs.Actuation(drive=Force((0.0,)), step=dt / 10),
        )
        errors.append(run.q.values[-1, 3] - r0 * np.cosh(0.6 * w))
    assert abs(errors[0]) < 2e-3
    np.testing.assert_allclose(errors[0] / errors[1], 2.0, rtol=0.1)


def test_an_object_on_the_robot_is_a_load():
    box = rs.Object("box", shapes=rs.Block(0.1, 0.1, 0.1, mass=0.5), on="lift.cage")
    robot, drive = build_lift(mass=2.0), rs.drives.GravityCompensatedPD(frequency=20.0)
    task = rs.FollowJoints(by={"cage": 0.0}, gain=1e-9, duration=0.1)
    settings = {"dt": 0.01, "duration": 1.0, "hold": True}
    run = rs.simulate(
        rs.Scene([robot], [box]), task, **settings, actuation=rs.Actuation(drive=drive)
    )
    np.testing.assert_allclose(run.torque.values[-1], 2.5 * G, rtol=1e-6)
    np.testing.assert_allclose(run.q.values[:, 0], 0.0, atol=1e-9)  # the start holds the load


def test_a_rolling_wheel_weighs_on_the_lift_that_carries_it():
    """The wheel follows the rail, so it moves ideally, and its mass is that of a fixed body."""
    robot = rs.robots.inspection_a()
    links = {link.name: link for link in robot.links}
    carried = sum(links[name].inertial.mass for name in ("front_lift", "front_wheel"))
    task = rs.FollowJoints(by={"front_lift": 0.0}, duration=0.1)
    actuation = rs.Actuation(drive=rs.drives.VelocityLoop())
    run = rs.simulate(rs.Scene([robot]), task, dt=0.01, duration=0.1, actuation=actuation)
    tilt = robot.fk(robot.home, "front_lift")[2, 2]
    weight = float(run.torque.values[0, list(robot.velocity_names).index("front_lift")])
    np.testing.assert_allclose(weight, carried * G * tilt, rtol=1e-9)


def test_the_times_of_a_load_count_from_the_start_of_a_mission():
    robot = build_lift(mass=2.0)
    task = rs.FollowJoints(by={"cage": 0.01}, duration=0.5)
    load = rs.drives.Payload("lift.cage", mass=1.0, attached=0.25, released=2.5)
    actuation = rs.Actuation(drive=rs.drives.VelocityLoop(), payloads=[load])
    mission = rs.Mission([rs.Phase("up", task), rs.Phase("on", task)])
    settings = {"dt": 0.01, "duration": 3.0, "actuation": actuation}
    legs = rs.Experiment(rs.Scene([robot]), mission, **settings).run().legs
    assert len(legs) == 2 and 0.5 < legs[0].end < 2.5
    for leg in legs:
        time = leg.start + leg.run.time.values
        loaded = (time > 0.35) & (time < 2.49)
        expected = np.where(loaded, 3.0, 2.0) * G
        settled = loaded | (time < 0.25) | (time > 2.9)
        torque = leg.run.torque.values[:, 0]
        settled &= np.isfinite(torque)  # a run ends before its record does
        np.testing.assert_allclose(torque[settled], expected[settled], atol=2.0)
    np.testing.assert_allclose(legs[1].run.torque.values[0, 0], 3.0 * G)


def test_a_load_beyond_the_limit_pulls_the_joint_down():
    robot = build_lift(mass=2.0, effort=15.0)
    run = hold(robot, rs.drives.VelocityLoop(gravity=False), 0.2)
    assert np.all(run.torque.values == 15.0)
    np.testing.assert_allclose(run.qd_actual.values[-1], 0.2 * (7.5 - G), rtol=1e-3)


@pytest.mark.parametrize(("dt", "parts"), [(1 / 30, 34), (0.01, 10), (0.0105, 11), (4e-4, 1)])
def test_the_usual_step_divides_any_period(dt, parts):
    from robsim.engine.driven_joints import count_substeps

    assert count_substeps(None, dt) == parts
    assert count_substeps(round(dt / parts, 9), dt) == parts


def test_a_mimicking_joint_adds_its_rotor_and_its_friction():
    """It turns at twice the rate: four times its armature and damping, and twice its friction."""
    body = Inertia(1.0, tensor=np.eye(3) * 0.1)
    vertical = {"armature": 0.2, "damping": 0.3}

    def build(tie):
        first = Joint("revolute", friction=0.5, **vertical)
        second = Joint("revolute", follows=tie, armature=0.05, damping=0.1, friction=0.2)
        links = [Link("base"), Link("a", "base", first, inertia=body)]
        return rs.Robot("pair", [*links, Link("b", "base", second, inertia=body)])

    force = 3.0
    run = hold(build(Mimic("a", 2.0)), Force((force,)), 0.5)
    inertia = 0.1 + 0.2 + 4 * (0.1 + 0.05)
    damping, friction = 0.3 + 4 * 0.1, 0.5 + 2 * 0.2
    v, h = 0.0, 1e-3
    for _ in range(499):  # in the first sub-step friction holds the joint
        v += h * (force - friction - damping * v) / (inertia + h * damping)
    np.testing.assert_allclose(run.qd_actual.values[-1, 0], v, rtol=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_a_carrier_turns_as_it_moves_and_not_as_it_was_commanded(share):
    """An imperfection of the command slows the vehicle, and with it the slide on the vehicle."""

    @dataclass(frozen=True)
    class Slower:
        def driven(self, wanted, drive):
            return share * wanted

    w, r0 = 1.5, 0.3
    steering = rs.joints.Steering(0.5, 0.6, 1000.0)
    car = rs.Robot(
        "cart", [Link("ground"), Link("body", "ground", Joint("car", steering=steering))]
    )
    along = Joint("prismatic", place=rs.Pose.at(rpy=(0, np.pi / 2, 0)))
    body = Inertia(1.0, tensor=np.eye(3) * 1e-3)
    slide = rs.Robot(
        "slide", [Link("rail"), Link("bead", "rail", along, inertia=body)], on="cart.body"
    )
    scene = rs.Scene([car, slide], motions=[rs.Motion("cart", rates=[0.5, w])])
    task = rs.FollowJoints(by={"bead": 0.0}, gain=1e-9, duration=0.1)
    run = rs.simulate(
        scene,
        task,
        {"slide": [r0]},
        dt=0.005,
        duration=0.6,
        hold=True,
        actuation=rs.Actuation(drive=Force((0.0,)), effects=[Slower()]),
    )
    turned = run.q.values[-1, 2] / 0.6  # the true yaw rate, which the steering limits
    assert turned < 0.9 * w
    assert abs(run.q.values[-1, 4] - r0 * np.cosh(0.6 * turned)) < 2e-3


def test_the_gains_of_a_drive_have_the_loads_of_its_model():
    from robsim.engine.driven_joints import DrivenJoints
    from robsim.engine.static_torques import StaticTorques

    box = rs.Object("box", shapes=rs.Block(0.1, 0.1, 0.1, mass=0.5), on="lift.cage")
    load = rs.drives.Payload("lift.cage", mass=0.25)
    scene = rs.Scene([build_lift(mass=2.0)], [box])
    for known, mass in ((False, 2.0), (True, 2.75)):
        drive = rs.drives.VelocityLoop(model=rs.drives.DriveModel(payload=known))
        actuation = rs.Actuation(drive=drive, payloads=[load])
        joints = DrivenJoints.of(scene, actuation, np.arange(1), 0.01)
        torques = StaticTorques(joints, np.zeros((1, 1)))
        np.testing.assert_allclose(torques.inertia, mass)
        np.testing.assert_allclose(torques.load, 2.75 * G)
        np.testing.assert_allclose(torques.fed, mass * G)


def test_the_belief_of_a_task_has_no_dynamics():
    experiment = rs.load_scenario(rs.examples.path("joint_friction"))
    for part in ("friction", "inertia.mass"):
        name = f"belief.robots.puma560.links.forearm.{part}"
        with pytest.raises(rs.errors.InputError, match="a task believes no masses"):
            experiment.at(name, 2.0)
        with pytest.raises(rs.errors.InputError, match="a task believes no masses"):
            experiment.vary({name: [1.0, 2.0]})


@pytest.mark.full
def test_the_command_writes_a_figure_of_the_torques(tmp_path):
    from robsim.cli.figure_files import write_run_figures

    experiment = rs.load_scenario(rs.examples.path("joint_friction")).with_(duration=0.2)
    write_run_figures(experiment.run(), experiment, tmp_path)
    assert (tmp_path / "torques.png").stat().st_size > 10_000
    bare = experiment.with_(actuation=rs.Actuation())
    (tmp_path / "bare").mkdir()
    write_run_figures(bare.run(), bare, tmp_path / "bare")
    assert not (tmp_path / "bare" / "torques.png").exists()


def test_gravity_moves_joints_without_commands_on_driven_robots_only():
    arm = build_pendulum()
    scene = rs.Scene([arm, replace(arm, name="second").at(rs.Pose.at(3, 0, 0))])
    settings = {"dt": 0.01, "duration": 0.3, "hold": True}
    settings["actuation"] = rs.Actuation(drive=Force((0.0, 0.0)), step=1e-3)
    task = rs.FollowJoints(by={"arm.upper": 0.0}, gain=1e-9, duration=0.1)
    both = rs.simulate(scene, task, scene.home, **settings)
    alone = hold(arm, Force((0.0, 0.0)), duration=0.3)
    np.testing.assert_array_equal(both.q[:, :2], alone.q)
    assert (np.abs(both.q[-1, :2] - both.q[0, :2]) > 0.05).all()
    np.testing.assert_array_equal(both.q[:, 2:], np.broadcast_to(arm.home, (31, 2)))
