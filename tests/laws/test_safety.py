"""The limits that every command is kept within, in the simulation and out of it."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.kernels.control.command_limits import braking_speed
from robsim.suites.suite_registry import load_suite

DT = 0.02
A, SPEED, MARGIN = 2.0, 0.8, 0.05


class Wild:
    """A law that commands random velocities, for a while each."""

    in_camera = False

    def __init__(self, seed, size=3.0):
        self.rng, self.size = np.random.default_rng(seed), size
        self.wish = None

    def command(self, state):
        if self.wish is None or self.rng.random() < 0.05:
            self.wish = self.rng.uniform(-self.size, self.size, state.jacobian.shape[::2])
        return self.wish


@pytest.fixture(scope="module")
def arm():
    return rs.load_scenario(examples.path("eye_in_hand")).with_(dt=DT)


def drive(experiment, steps, **how):
    """The coordinates, commands and healths of an arm that is driven, one image for all."""
    controller, scene = rs.Controller(experiment), experiment.scene
    pixels = scene.view(experiment.start, points="plate").pixels
    q, rows = experiment.start.copy(), []
    for step in range(steps):
        command = controller.step(pixels, q, step * experiment.dt, **how)
        rows.append((q, command))
        q = q + command.velocities * experiment.dt
    return np.array([q for q, _ in rows]), [command for _, command in rows]


def velocities(commands):
    return np.array([command.velocities for command in commands])


@pytest.mark.parametrize("seed", range(40))
def test_the_largest_velocity_from_which_a_joint_stops_in_time(seed):
    """It is held for a period, then falls by a dt in each: the way is all that there is, or less
    than a billionth of it is left."""
    rng = np.random.default_rng(seed)
    distance, a, dt = 10 ** rng.uniform(-6, 1), 10 ** rng.uniform(-1, 2), 10 ** rng.uniform(-3, -1)
    v, way = braking_speed(distance, a, dt), 0.0
    while v > 0:
        way, v = way + v * dt, v - a * dt
    np.testing.assert_allclose(way, distance, rtol=1e-9)


def test_ends_of_braking():
    assert braking_speed(0.0, 1.0, 0.1) == braking_speed(-1.0, 1.0, 0.1) == 0.0
    assert (
        braking_speed(np.inf, 1.0, 0.1) == np.inf and braking_speed(0.3, np.inf, 0.1) == 0.3 / 0.1
    )
    assert braking_speed(np.nan, 1.0, 0.1) == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_whatever_a_law_commands_joints_stay_within_all_limits(arm, seed):
    safety = rs.Safety(speed=SPEED, acceleration=A, margin=MARGIN)
    wild = arm.with_(safety=safety).at("task.law", Wild(seed)).at("task.secondary", None)
    q, commands = drive(wild, 1500)
    qd, (low, high) = velocities(commands), arm.scene.limits.T
    assert np.abs(qd).max() <= SPEED * (1 + 1e-12)
    assert np.abs(np.diff(qd, axis=0)).max() <= A * DT * (1 + 1e-9)
    assert (q >= low + MARGIN - 1e-9).all() and (q <= high - MARGIN + 1e-9).all()
    near = np.minimum(q - low, high - q).min(axis=0) - MARGIN
    assert (near < 1e-3).sum() >= 2  # limits were reached, and no more than that
    found = {limit for command in commands for limit in command.health.limits}
    assert {"speed", "acceleration"} < found and any("joint limit of link" in x for x in found)


@pytest.mark.parametrize("a", [None, 4.0, 1.0])
def test_a_frame_stays_behind_its_fence(arm, a):
    """It does if its braking path does not bulge, else to half a millimetre."""
    at = arm.scene.pose("camera", arm.start).position
    fence = rs.control.Fence("camera", at - 0.05, at + 0.05)
    safety = rs.Safety(speed=SPEED, acceleration=a, margin=0.0, fence=fence)
    wild = arm.with_(safety=safety).at("task.law", Wild(3)).at("task.secondary", None)
    q, commands = drive(wild, 1000)
    place = np.array([arm.scene.pose("camera", each).position for each in q]) - at
    assert 0.05 - 1e-3 < np.abs(place).max() < 0.05 + 5e-4
    held = ["fence" in command.health.limits for command in commands]
    assert 0.1 < np.mean(held) < 1.0
    if a is not None:
        assert np.abs(np.diff(velocities(commands), axis=0)).max() <= a * DT * (1 + 1e-9)
    speed = np.linalg.norm(np.diff(place, axis=0), axis=1) / DT
    assert speed.max() > 0.1  # within it the arm moves on


def test_a_frame_outside_its_fence_may_go_back(arm):
    at = arm.scene.pose("camera", arm.start).position
    fence = rs.control.Fence("camera", at - np.array([1.0, 1.0, -0.05]), at + 1.0)
    safety = rs.Safety(acceleration=1.0, fence=fence)
    q, _ = drive(arm.with_(safety=safety), 200)  # the goal is above
    height = np.array([arm.scene.pose("camera", each).position[2] for each in q]) - at[2]
    assert height.min() > -1e-9 and height[-1] > 0.05


def test_speed_slows_the_command_and_keeps_its_direction(arm):
    free, slow = arm.run(duration=DT), arm.run(duration=DT, safety=rs.Safety(speed=0.01))
    qd = free.qd.values[0]
    np.testing.assert_allclose(slow.qd.values[0], qd * 0.01 / np.abs(qd).max(), rtol=1e-12)


def test_a_start_without_a_bump(arm):
    """The command grows from nothing as 3 x^2 - 2 x^3."""
    free = rs.Controller(arm)
    soft = rs.Controller(arm.with_(safety=rs.Safety(ramp=0.4)))
    pixels = arm.scene.view(arm.start, points="plate").pixels
    for step in range(30):
        x = min(step * DT / 0.4, 1.0)
        whole = free.step(pixels, arm.start, step * DT).velocities
        found = soft.step(pixels, arm.start, step * DT).velocities
        np.testing.assert_allclose(found, (3 * x**2 - 2 * x**3) * whole, rtol=1e-12, atol=0)


def test_a_start_with_an_acceleration_has_none_either(arm):
    _, commands = drive(arm.with_(safety=rs.Safety(acceleration=A)), 5)
    for step, command in enumerate(commands, 1):
        assert np.abs(command.velocities).max() <= step * A * DT * (1 + 1e-12)


def test_the_watchdog_holds_until_an_image_comes(arm):
    safety = rs.Safety(acceleration=2.0, watchdog=rs.control.Watchdog(0.1))
    controller = rs.Controller(arm.with_(safety=safety))
    pixels, q = arm.scene.view(arm.start, points="plate").pixels, arm.start
    for step in range(20):
        command = controller.step(pixels, q, step * DT)
    moving = command.velocities
    phases, speeds = [], []
    for step in range(20, 45):
        command = controller.step(None, q, step * DT)
        phases.append(command.phase)
        speeds.append(command.velocities)
    assert phases == ["moving"] * 5 + ["holding"] * 20  # the last image came at step 19
    assert command.health.stale and abs(command.health.age - 25 * DT) < 1e-12
    assert not speeds[-1].any()
    for after in speeds[5:]:  # along one line, to rest
        np.testing.assert_allclose(np.outer(after, moving), np.outer(moving, after), atol=1e-12)
    again = controller.step(pixels, q, 45 * DT)
    assert again.phase == "moving" and again.velocities.any() and not again.health.stale


def test_a_watchdog_may_stop_the_robot_for_good(arm):
    safety = rs.Safety(watchdog=rs.control.Watchdog(0.1, "stop"))
    controller = rs.Controller(arm.with_(safety=safety))
    pixels, q = arm.scene.view(arm.start, points="plate").pixels, arm.start
    assert controller.step(pixels, q, 0.0).velocities.any()
    assert controller.step(None, q, 0.12).phase == "stopped"
    for step in range(7, 20):
        command = controller.step(pixels, q, step * DT)
        assert command.phase == "stopped" and not command.velocities.any()
    controller.reset()
    assert controller.step(pixels, q, 0.0).phase == "moving"


def test_an_image_without_a_mark_is_none_for_the_watchdog(arm):
    controller = rs.Controller(arm.with_(safety=rs.Safety(watchdog=rs.control.Watchdog(0.1))))
    pixels = arm.scene.view(arm.start, points="plate").pixels
    controller.step(pixels, arm.start, 0.0)
    for step in range(1, 10):
        command = controller.step(np.full((4, 2), np.nan), arm.start, step * DT)
    assert command.phase == "holding" and command.health.lost == tuple(
        f"plate[{i}]" for i in range(4)
    )


def test_hold_to_run_moves_only_while_it_is_reported(arm):
    safety = rs.Safety(acceleration=1.0, hold_to_run=True)
    controller = rs.Controller(arm.with_(safety=safety))
    pixels, q = arm.scene.view(arm.start, points="plate").pixels, arm.start
    assert not controller.step(pixels, q, 0.0).velocities.any()
    commands = [controller.step(pixels, q, step * DT, run=True) for step in range(1, 10)]
    assert commands[-1].phase == "moving" and commands[-1].velocities.any()
    let_go = [controller.step(pixels, q, step * DT) for step in range(10, 30)]
    assert {command.phase for command in let_go} == {"holding"}
    sizes = np.abs(velocities([commands[-1], *let_go])).max(axis=1)
    assert (np.diff(sizes[:4]) < 0).all() and sizes[-1] == 0
    assert np.abs(np.diff(velocities(let_go), axis=0)).max() <= DT * (1 + 1e-9)


def test_a_command_that_is_not_finite_is_not_passed_on():
    class Broken:
        in_camera = False

        def command(self, state):
            return np.full(state.jacobian.shape[::2], np.inf)

    arm = rs.load_scenario(examples.path("eye_in_hand")).at("task.law", Broken())
    controller = rs.Controller(arm.at("task.secondary", None))
    pixels = arm.scene.view(arm.start, points="plate").pixels
    command = controller.step(pixels, arm.start, 0.0)
    assert not command.velocities.any()
    assert command.phase == "holding" and command.health.limits == ("not finite",)


SAFE = rs.Safety(
    speed=0.3, acceleration=1.5, margin=0.02, ramp=0.2, watchdog=rs.control.Watchdog(0.5)
)


def test_a_simulated_run_is_kept_within_the_same_limits_to_the_bit(arm):
    made = arm.with_(safety=SAFE, duration=2.0)
    run, controller = made.run(), rs.Controller(made)
    for t in range(101):
        command = controller.step(run.pixels.values[t], run.q.values[t], t * DT)
        np.testing.assert_array_equal(command.velocities, run.qd.values[t])
    assert not np.array_equal(run.qd.values, arm.run(duration=2.0).qd.values)


def test_late_and_rare_images_agree_with_the_simulation_to_the_bit(arm):
    """Every third period an image, two periods late: depths belong to its exposure, and
    the watchdog counts from then."""
    sensing = rs.Sensing(latency=2 * DT, period=3 * DT)
    dog = rs.Safety(acceleration=1.5, watchdog=rs.control.Watchdog(3.5 * DT))
    made = arm.with_(sensing=sensing, safety=dog, duration=1.2).at("task.interaction", "current")
    run, controller, held = made.run(), rs.Controller(made), 0
    (sight,) = controller.sights
    for t in range(61):
        image = None
        if t % 3 == 0:  # the first image belongs to the start, as old
            q = run.q.values[max(t - 2, 0), :, None]
            image = rs.control.Marks(sight.project(q).pixels[..., 0], (t - 2) * DT)
        command = controller.step(image, run.q.values[t], t * DT)
        np.testing.assert_array_equal(command.velocities, run.qd.values[t])
        held += command.phase == "holding"
    assert held > 10


def test_runs_of_a_batch_are_each_as_alone(arm):
    starts = arm.start + np.linspace(-0.02, 0.02, 9)[:, None]
    made = arm.with_(safety=SAFE, duration=1.0)
    batch = made.with_(start=starts).run(chunk=4, threads=2)
    for i in (0, 4, 8):
        np.testing.assert_array_equal(made.with_(start=starts[i]).run().qd, batch.qd[i])


def test_a_run_that_is_held_back_does_not_count_as_arrived_or_stuck(arm):
    """A slow start and rare images delay the end; they do not make it another."""
    slow = rs.Safety(ramp=0.1, acceleration=0.5, watchdog=rs.control.Watchdog(0.15))
    run = arm.run(safety=slow, sensing=rs.Sensing(period=0.2), duration=60.0)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.CONVERGED
    assert float(run.distance_to_goal) < 1e-4


def test_a_safety_is_written_and_read_to_the_bit(arm):
    fence = rs.control.Fence("camera", (-1, -1, 0), (1, 1, 1 / 3))
    every = rs.Safety(0.5, 1.0, [0.1] * 7, fence, rs.control.Watchdog(0.2, "stop"), 0.3, True)
    made = arm.with_(safety=every)
    again = rs.Experiment.from_text(made.to_toml(), "text")
    assert again == made and again.safety == every and again.hash == made.hash
    assert rs.replay(made.run(duration=0.2)).identical(made.run(duration=0.2))
    assert made.at("safety.speed", "30 deg/s").safety.speed == pytest.approx(np.pi / 6)


@pytest.mark.parametrize(
    ("safety", "about"),
    [
        ({"speed": 1e-3}, "safety.speed"),
        ({"acceleration": 1e-3}, "safety.acceleration"),
        ({"fence": "above"}, "safety.fence"),
        ({"watchdog": rs.control.Watchdog(0.05, "stop")}, "safety.watchdog"),
        ({"ramp": 30.0}, "safety.ramp"),
    ],
)
def test_a_safety_that_keeps_a_run_from_its_goal_is_named(arm, safety, about):
    at = arm.scene.pose("camera", arm.start).position
    if safety.get("fence") == "above":
        safety = {"fence": rs.control.Fence("camera", at - 0.5, at + 0.1)}
    made = arm.with_(dt=0.04, duration=12.0, safety=rs.Safety(**safety))
    run = made.run(sensing=rs.Sensing(period=0.12))
    assert rs.Outcome(int(run.outcome)) is not rs.Outcome.CONVERGED
    assert about in [cause.about for cause in rs.explain(run).causes]


@pytest.mark.parametrize("a", [None, 5.0])
def test_a_fence_that_one_is_outside_of_holds_on_its_other_sides(arm, a):
    """Out by 10 cm along x, the camera may come back, and still not go through the ceiling."""
    at = arm.scene.pose("camera", arm.start).position
    fence = rs.control.Fence(
        "camera", at + np.array([0.1, -1.0, -1.0]), at + np.array([1, 1, 0.03])
    )
    safety = rs.Safety(acceleration=a, fence=fence, margin=0.0)
    wild = arm.with_(safety=safety).at("task.law", Wild(1, 0.5)).at("task.secondary", None)
    q, commands = drive(wild, 600)
    place = np.array([arm.scene.pose("camera", each).position for each in q]) - at
    assert place[:, 2].max() < 0.03 + 1e-4 and place[:, 2].max() > 0.02
    outside = np.maximum(0.1 - place[:, 0], 0.0)
    assert (np.diff(outside) < 1e-4).all() and outside[-1] < 0.05
    assert any("fence" in command.health.limits for command in commands)


def test_a_margin_that_stops_a_joint_is_reported_in_degrees(arm):
    """One joint is stopped half way to its end without the limit."""
    made = arm.with_(dt=0.04, duration=12.0)
    low, high = arm.scene.limits.T
    way = made.run().q_end.values - arm.start
    half = arm.start + way / 2
    room = np.where(way > 0, high - half, half - low) + 9.0 * (np.abs(way) < 0.05)
    joint, margin = int(np.argmin(room)), np.zeros(7)
    margin[joint] = room[joint]
    explanation = rs.explain(made.run(safety=rs.Safety(margin=margin)))
    (cause,) = explanation.causes
    assert cause.about == "safety.margin"
    name, degrees = arm.scene.coordinate_names[joint], f"{np.degrees(room[joint]):.3g} degrees"
    assert f"The safety stops joint {name} {degrees} before its limit." in cause.sentence


def test_limits_that_do_no_harm_are_in_the_way_and_those_that_never_act_are_not(arm):
    at = arm.scene.pose("camera", arm.start).position
    safety = rs.Safety(100.0, 1e6, fence=rs.control.Fence("camera", at - 0.5, at + 0.1), ramp=0.1)
    made = arm.with_(dt=0.04, duration=12.0, safety=safety)
    explanation = rs.explain(made.run())
    assert [cause.about for cause in explanation.causes] == ["safety.fence"]
    ramp = "the slow start of the safety"
    assert explanation.remarks == (f"Not the cause, though in the way as well: {ramp}.",)
    unread = rs.explain(made.run(sensing=rs.Sensing(noise=1e-3)), trials=False)
    words = (
        f"Also wrong or in the way in this run, and not examined: pixel noise, the fence and {ramp}"
    )
    assert unread.remarks == (f"{words}.",)


class Constant:
    """A law that always commands the same velocities."""

    in_camera = False

    def __init__(self, velocities):
        self.velocities = np.array(velocities)

    def command(self, state):
        return np.tile(self.velocities, (state.jacobian.shape[0], 1))


def task_jacobian(experiment, q):
    return experiment.task.task_jacobian(experiment.scene, q).matrix


def test_a_command_beyond_its_acceleration_is_slowed_rather_than_deflected(arm):
    """From rest, each velocity may reach 0.04 rad/s in the first period."""
    made = arm.with_(safety=rs.Safety(acceleration=A)).at("task.secondary", None)
    J, rng, deflections = task_jacobian(made, arm.start), np.random.default_rng(3), []
    for wish in 0.4 * rng.normal(size=(20, 7)):
        qd = velocities(drive(made.at("task.law", Constant(wish)), 1)[1])[0]
        assert np.abs(qd).max() <= A * DT
        each = np.array([qd, np.clip(wish, -A * DT, A * DT), wish]) @ J.T
        each /= np.linalg.norm(each, axis=1, keepdims=True)
        deflections.append(np.arccos(each[:2] @ each[2]))
    limited, clipped = np.mean(deflections, axis=0)
    assert limited < 0.5 * clipped


def test_other_joints_replace_a_joint_that_is_at_its_limit(arm):
    """The seventh degree of freedom keeps the change of the features."""
    low, _ = arm.scene.limits.T
    wish = np.array([0.0, 0.05, 0.02, -0.1, 0.0, 0.03, 0.0])
    margin = np.zeros(7)
    margin[3] = arm.start[3] - low[3]  # no way down for this joint
    made = arm.with_(safety=rs.Safety(margin=margin)).at("task.secondary", None)
    qd = velocities(drive(made.at("task.law", Constant(wish)), 1)[1])[0]
    assert abs(qd[3]) < 1e-12
    J = task_jacobian(made, arm.start)
    clipped = np.where(np.arange(7) == 3, 0.0, wish)
    kept, lost = (np.linalg.norm(J @ (each - wish)) for each in (qd, clipped))
    assert kept < 0.3 * lost


def test_as_many_runs_arrive_with_a_safety_as_without():
    """Panda near its joint limits, of which clamped joints lost 13 of 500."""
    suite = load_suite("near_limits")
    task = rs.IBVS(goal=suite.task_goal, gain=suite.gain)
    arrived = []
    for safety in None, rs.Safety(speed=2.0, acceleration=8.0, margin=0.01):
        settings = {"dt": suite.dt, "duration": suite.duration, "record": "summary"}
        run = rs.simulate(suite.scene, task, suite.starts[::5], safety=safety, **settings)
        arrived.append(int((run.outcome.values == rs.Outcome.CONVERGED).sum()))
    assert arrived[1] >= arrived[0] >= 90


@pytest.mark.parametrize("gain", [1.5, 6.0])
def test_a_safety_does_not_change_commands_within_the_same_constraints(gain):
    suite, kinds = load_suite("near_limits"), rs.constraints
    limits = kinds.JointLimits(0.01), kinds.JointSpeeds(2.0), kinds.JointAccelerations(8.0)
    law = rs.laws.ConstrainedLaw(limits)
    task = rs.IBVS(goal=suite.task_goal, gain=gain, law=law)
    safety = rs.Safety(speed=2.0, acceleration=8.0, margin=0.01)
    settings = {"dt": suite.dt, "duration": 2.0}
    runs = [
        rs.simulate(suite.scene, task, suite.starts[::10], safety=each, **settings)
        for each in (None, safety)
    ]
    np.testing.assert_allclose(runs[0].qd.values, runs[1].qd.values, rtol=0, atol=1e-9)
    assert (runs[0].active.values[..., :14] > 0.0).any()
