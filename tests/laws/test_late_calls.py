"""Limits of a controller that is called early, late, or after a pause."""

import numpy as np
import pytest

import robsim as rs
from robsim.servo.safety.guard import compute_bernstein_matrix

BOX, TOLERANCE = (
    0.15,
    1e-4,
)  # half the size of the fence, and how far a frame may leave it, in metres


class Wild:
    """A law that commands random velocities, for a while each."""

    in_camera = False

    def __init__(self, seed):
        self.rng, self.wish = np.random.default_rng(seed), None

    def command(self, state):
        if self.wish is None or self.rng.random() < 0.05:
            self.wish = self.rng.uniform(-3.0, 3.0, state.jacobian.shape[::2])
        return self.wish


@pytest.fixture(scope="module")
def arm():
    return rs.load_scenario(rs.examples.path("eye_in_hand"))


def guard(arm, dt, seed=0, **limits):
    """An experiment with random commands, and with a fence around the start of the camera."""
    at = arm.scene.pose("camera", arm.start).position
    fence = rs.control.Fence("camera", at - BOX, at + BOX)
    safety = rs.Safety(speed=1.5, fence=fence, **limits)
    made = arm.with_(dt=dt, safety=safety)
    return made.at("task.law", Wild(seed)).at("task.secondary", None)


class Drive:
    """The joints and commands of an arm that executes each command until the next call.

    `outside` has the distances of the camera from the fence, also between calls.
    """

    def __init__(self, experiment, intervals):
        self.experiment, scene = experiment, experiment.scene
        controller, q, t = rs.Controller(experiment), experiment.start, 0.0
        pixels = scene.view(q, points="plate").pixels
        fence, self.q, self.commands, self.outside, self.speeds = (
            experiment.safety.fence,
            [],
            [],
            [],
            [],
        )
        for seconds in intervals:
            command = controller.step(pixels, q, t)
            places = [
                scene.pose("camera", q + share * seconds * command.velocities).position
                for share in (0.0, 0.5, 1.0)
            ]
            self.outside += [np.max([fence.low - p, p - fence.high]) for p in places]
            self.speeds.append(np.linalg.norm(places[2] - places[0]) / seconds)
            self.q.append(q)
            self.commands.append(command)
            q, t = q + seconds * command.velocities, t + seconds

    def list_limits(self):
        return {limit for command in self.commands for limit in command.health.limits}

    def check_acceleration(self):
        """Velocities change by at most a dt."""
        qd = np.array([command.velocities for command in self.commands])
        most = self.experiment.safety.acceleration * self.experiment.dt
        assert np.abs(np.diff(qd, axis=0)).max() <= most * (1 + 1e-9)

    def check_joints(self):
        """Joints stay within their limits, and velocities change by at most a dt."""
        low, high = self.experiment.scene.limits.T
        q = np.array(self.q)
        self.check_acceleration()
        assert (q >= low - 1e-9).all() and (q <= high + 1e-9).all()


PATTERNS = {  # period, declared longest time between calls, and the times between calls
    "on time": (0.04, None, lambda rng, dt: [dt] * 400),
    "30 % apart": (0.02, 0.026, lambda rng, dt: dt * rng.uniform(0.7, 1.3, 400)),
    "30 % early or late": (
        0.02,
        0.032,
        lambda rng, dt: np.diff(dt * (np.arange(401) + rng.uniform(-0.3, 0.3, 401))),
    ),
    "30 to 120 ms apart": (0.04, 0.12, lambda rng, dt: rng.uniform(0.03, 0.12, 300)),
    "four calls a period": (0.04, 0.015, lambda rng, dt: rng.uniform(0.005, 0.015, 800)),
}


@pytest.mark.parametrize("acceleration", [4.0, 0.5])
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.few(3)
def test_a_fence_and_joint_limits_hold_for_calls_up_to_the_declared_interval(
    arm, pattern, acceleration
):
    """Joints that stop at their limits turn the braking motion: the fence holds there as well."""
    dt, longest, intervals = PATTERNS[pattern]
    made = guard(arm, dt, acceleration=acceleration, margin=0.0, call_interval=longest)
    drive = Drive(made, intervals(np.random.default_rng(7), dt))
    assert -0.02 < max(drive.outside) < TOLERANCE
    drive.check_joints()
    limits = drive.list_limits()
    assert {"fence", "acceleration"} < limits and "late call" not in limits
    assert max(drive.speeds) > 0.1


@pytest.mark.full
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_fence_holds_for_many_motions(arm, pattern, seed):
    dt, longest, intervals = PATTERNS[pattern]
    acceleration = [0.3, 1.0, 3.0][seed % 3]
    margin = None if seed % 2 else 0.0
    made = guard(arm, dt, seed, acceleration=acceleration, margin=margin, call_interval=longest)
    drive = Drive(made, intervals(np.random.default_rng(seed), dt))
    assert max(drive.outside) < TOLERANCE


@pytest.mark.parametrize("seed", range(3))
def test_a_call_after_the_declared_interval_brakes_and_costs_no_more_than_its_lateness(arm, seed):
    """Beyond the fence: at most the motion of the frame in the time by which calls are late."""
    dt, longest = 0.02, 0.03
    rng, made = (
        np.random.default_rng(seed),
        guard(arm, dt, seed, acceleration=2.0, margin=0.0, call_interval=0.03),
    )
    intervals = np.where(rng.random(400) < 0.03, rng.uniform(0.06, 0.2, 400), dt)
    drive = Drive(made, intervals)
    late = np.maximum(intervals - (dt + longest), 0.0)
    excess = np.cumsum(late * drive.speeds)
    outside = np.array(drive.outside).reshape(-1, 3).max(axis=1)
    assert (outside < excess + TOLERANCE).all()
    drive.check_acceleration()
    after = [drive.commands[i + 1] for i in np.flatnonzero(late[:-1] > 0)]
    assert len(after) > 5
    assert {c.phase for c in after} == {"holding"}
    assert all("late call" in c.health.limits for c in after)
    assert drive.commands[-1].phase == "moving" or late[-2] > 0


def test_the_simulation_plans_for_the_declared_interval_to_the_bit(arm):
    at = arm.scene.pose("camera", arm.start).position
    fence = rs.control.Fence("camera", at - 0.5, at + 0.02)
    runs = []
    for longest in (None, 0.05):
        safety = rs.Safety(acceleration=0.5, fence=fence, call_interval=longest)
        made = arm.with_(safety=safety, duration=1.5)
        run, controller = made.run(), rs.Controller(made)
        for step in range(run.sizes["time"] - 1):
            command = controller.step(run.pixels.values[step], run.q.values[step], step * made.dt)
            np.testing.assert_array_equal(command.velocities, run.qd.values[step])
        runs.append(run)
    assert not np.array_equal(runs[0].qd.values, runs[1].qd.values)


def test_the_predicted_path_contains_the_path_of_the_frame(arm):
    """Along random directions, against poses at 101 places; all joints move together 4 rad."""
    rng, matrix = np.random.default_rng(3), compute_bernstein_matrix(6)
    low, high = arm.scene.limits.T
    directions = rng.normal(size=(3, 200))
    directions /= np.linalg.norm(directions, axis=0)
    for _ in range(10):
        q, way = rng.uniform(low, high), rng.normal(size=7)
        way *= 4.0 / np.abs(way).sum()

        def place(share, q=q, way=way):
            return arm.scene.pose("camera", q + share * way).position

        seven = np.array([place(i / 6) for i in range(7)])
        hull = np.vstack([seven[:1], seven[0] + matrix @ (seven[1:] - seven[0])])
        path = np.array([place(share) for share in np.linspace(0, 1, 101)])
        excess = (path @ directions).max(axis=0) - (hull @ directions).max(axis=0)
        assert excess.max() < TOLERANCE
        np.testing.assert_allclose(hull[-1], path[-1], atol=1e-12)


LEAPS = {
    "ahead": 100.0,
    "far ahead": 1e9,
    "back": -100.0,
    "no number": "later",
    "not finite": np.nan,
    "too far": 1e300,
}


class Unconvertible:
    """A time that raises an error of its own."""

    def __float__(self):
        raise RuntimeError("no time")


LEAPS["an error"] = Unconvertible()


@pytest.mark.parametrize("leap", LEAPS)
def test_a_clock_that_leaps_stops_a_robot_that_continues_within_its_acceleration(arm, leap):
    """The driver holds the last command, so that zero at once would be a step of the velocity."""
    safety = rs.Safety(acceleration=0.3, driver_holds=True)
    controller = rs.Controller(arm.with_(dt=0.02, safety=safety))
    pixels, q, t, commands = arm.scene.view(arm.start, points="plate").pixels, arm.start, 0.0, []
    for step in range(160):
        given = t
        if step == 40:
            assert np.abs(commands[-1].velocities).max() > 0.1
            given = LEAPS[leap]
            if isinstance(given, float) and abs(given) < 1e12:
                t = given = t + given
        commands.append(controller.step(pixels, q, given))
        q, t = q + 0.02 * commands[-1].velocities, t + 0.02
    assert commands[40].phase == "holding" and commands[40].health.fault
    speeds = np.array([np.abs(command.velocities).max() for command in commands])
    changes = np.diff([command.velocities for command in commands], axis=0)
    assert np.abs(changes).max() <= 0.3 * 0.02 * (1 + 1e-9)
    assert speeds[40] < speeds[39]
    if "ahead" in leap:  # a pause for the controller: it comes to rest, and then begins anew
        stop = 40 + int(np.argmax(speeds[40:] == 0.0))
        assert stop > 50 and (np.diff(speeds[39 : stop + 1]) < 0).all()
        faults = [command.health.fault for command in commands[40 : stop + 1]]
        assert all("the memory of the scheme is reset" in fault for fault in faults)
        assert commands[stop + 1].phase == "moving" and not commands[stop + 1].health.fault


def test_a_robot_that_does_not_continue_is_at_rest_after_a_pause(arm):
    controller = rs.Controller(arm.with_(dt=0.02, safety=rs.Safety(acceleration=0.3)))
    pixels = arm.scene.view(arm.start, points="plate").pixels
    for step in range(40):
        assert controller.step(pixels, arm.start, step * 0.02).phase == "moving"
    assert not controller.step(pixels, arm.start, 100.0).velocities.any()


def test_a_time_that_cannot_be_converted_is_a_fault(arm):
    """The conversion runs code of the value, which may raise any error."""
    controller = rs.Controller(arm)
    pixels = arm.scene.view(arm.start, points="plate").pixels
    with pytest.raises(
        rs.errors.InputError, match=r"t \(seconds\): expected a number, got <.*Unconv"
    ):
        controller.step(pixels, arm.start, Unconvertible())
    controller.step(pixels, arm.start, 0.0)
    command = controller.step(pixels, arm.start, Unconvertible())
    assert command.phase == "holding" and "t (seconds): expected a number" in command.health.fault
    assert controller.row()["fault"] == command.health.fault
    assert controller.step(pixels, arm.start, arm.dt).phase == "moving"
