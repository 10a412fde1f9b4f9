"""A controller on its own under the faults of robots: pauses, clocks, lost marks, odd data."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples

DT = 0.04
SAFE = rs.Safety(acceleration=0.5, ramp=0.2)
REMEMBERS = {
    "broyden": {"task.interaction": "broyden"},
    "estimated": {"task.feed_forward": "estimated"},
    "smooth": {"task.smooth_start": 2.0},
    "depth filter": {"task.depth": rs.laws.DepthFilter(0.9)},
}


@pytest.fixture(scope="module")
def one():
    return rs.load_scenario(examples.path("visp_tutorial"))


@pytest.fixture(scope="module")
def run(one):
    return one.run(duration=2.4)


def at(run, t):
    return run.pixels.values[t], run.q.values[t]


def drive(controller, run, steps, first=0, start=0.0):
    """The commands of a controller that is fed a run for some periods."""
    return [controller.step(*at(run, t), start + t * DT) for t in range(first, first + steps)]


@pytest.mark.parametrize("scheme", REMEMBERS)
def test_a_scheme_with_a_memory_begins_when_the_marks_are_there(one, run, scheme):
    made = one.at(REMEMBERS[scheme])
    plain, waited = rs.Controller(made), rs.Controller(made)
    for t in range(3):
        assert waited.step(None, run.q.values[0], (t - 3) * DT).phase == "waiting"
    for t in range(20):
        expected = plain.step(*at(run, t), t * DT).velocities
        np.testing.assert_array_equal(waited.step(*at(run, t), t * DT).velocities, expected)


@pytest.mark.parametrize("scheme", [*REMEMBERS, "plain"])
def test_after_a_pause_it_begins_anew_from_rest(one, run, scheme):
    made = one.at(REMEMBERS.get(scheme, {"task.gain": one.task.gain}))
    controller = rs.Controller(made.with_(safety=SAFE))
    drive(controller, run, 20)
    pause = controller.step(*at(run, 20), 60.0)
    assert pause.phase == "holding" and not pause.velocities.any()
    assert pause.health.fault.startswith("no call for 59.2 s")
    again = [controller.step(*at(run, t), 60.0 + (t - 20) * DT) for t in range(21, 31)]
    fresh = rs.Controller(made.with_(safety=SAFE))
    fresh.step(*at(run, 20), 0.0, run=False)
    for t, command in enumerate(again, 21):
        assert command.phase == "moving"
        expected = fresh.step(*at(run, t), (t - 20) * DT).velocities
        if scheme == "plain":
            np.testing.assert_allclose(command.velocities, expected, rtol=0, atol=1e-12)
    sizes = np.abs([command.velocities for command in again]).max(axis=1)
    assert sizes[0] <= 0.5 * DT * (1 + 1e-9) and (np.diff(sizes) <= 0.5 * DT * (1 + 1e-9)).all()


def test_the_time_of_a_path_stands_while_the_robot_is_held():
    arm = rs.robots.planar_2r()
    task = rs.FollowJoints(by=[1.0, 0.5], duration=2.0)
    made = rs.Experiment(rs.Scene(arm), task, dt=DT)
    controller, q, fastest = rs.Controller(made), arm.home.copy(), 0.0
    for t in range(120):
        held = 20 <= t < 60
        command = controller.step(None, q, t * DT, run=not held)
        assert not (held and command.velocities.any())
        fastest = max(fastest, np.abs(command.velocities).max())
        q = q + command.velocities * DT
    assert fastest < 1.05 * np.nanmax(np.abs(made.run().qd.values))
    np.testing.assert_allclose(q - arm.home, [1.0, 0.5], atol=1e-9)


def test_a_missed_call_is_no_leap_along_a_path():
    arm = rs.robots.planar_2r()
    made = rs.Experiment(rs.Scene(arm), rs.FollowJoints(by=[1.0, 0.5], duration=2.0), dt=DT)
    controller, q, sizes = rs.Controller(made), arm.home.copy(), []
    for t in (t for t in range(60) if t % 7 != 6):
        command = controller.step(None, q, t * DT)
        sizes.append(np.abs(command.velocities).max())
        q = q + command.velocities * DT
    assert max(sizes) < 1.05 * np.nanmax(np.abs(made.run().qd.values))


def test_images_from_the_future_are_not_used(one, run):
    controller = rs.Controller(one.with_(safety=rs.Safety(watchdog=rs.control.Watchdog(0.1))))
    drive(controller, run, 5)
    odd = controller.step(rs.control.Marks(run.pixels.values[9], 1000.0), run.q.values[5], 5 * DT)
    assert odd.health.unused == ("image of camera taken in the future",)
    assert odd.health.age == pytest.approx(DT)
    again = controller.step(*at(run, 6), 6 * DT)
    assert again.health.unused == () and again.health.age == 0.0
    silent = [controller.step(None, run.q.values[7], t * DT) for t in range(7, 12)]
    assert silent[-1].phase == "holding" and silent[-1].health.stale
    assert silent[-1].health.limits == ("watchdog",)


def test_stamps_of_another_clock_never_count_as_new(one, run):
    controller = rs.Controller(one.with_(safety=rs.Safety(watchdog=rs.control.Watchdog(0.1))))
    for t in range(10):
        pixels, q = at(run, t)
        command = controller.step(rs.control.Marks(pixels, 1.7e9 + t * DT), q, t * DT)
    assert command.phase == "waiting" and command.health.unused


def test_a_clock_that_stands_still_is_a_fault(one, run):
    controller = rs.Controller(one.with_(safety=SAFE))
    moving = drive(controller, run, 20)[-1].velocities
    for _ in range(999):
        command = controller.step(*at(run, 20), 19 * DT)
    np.testing.assert_array_equal(command.velocities, moving)
    command = controller.step(*at(run, 20), 19 * DT)
    assert "stands still at 0.76 s" in command.health.fault and command.phase == "holding"
    assert drive(controller, run, 1, first=20)[0].phase == "moving"


@pytest.mark.parametrize("wrong", [np.nan, -7.0, 1e17, 1e300, -1e300, "x"])
def test_a_wrong_time_is_soon_forgotten(one, run, wrong):
    controller = rs.Controller(one.with_(safety=SAFE))
    before = drive(controller, run, 20)[-1].velocities
    for _ in range(10):  # in one period: it brakes once
        bad = controller.step(*at(run, 20), wrong)
        assert bad.health.fault.startswith("t") and bad.phase == "holding"
        if wrong == -7.0:
            break
    assert np.abs(before - bad.velocities).max() <= 0.5 * DT * (1 + 1e-9)
    after = drive(controller, run, 4, first=20)
    assert after[-1].phase == "moving" and after[-1].health.fault == ""


def test_a_clock_that_was_set_goes_on(one, run):
    """After a leap to and fro it brakes, begins anew, and images count again."""
    controller = rs.Controller(one.with_(safety=rs.Safety(watchdog=rs.control.Watchdog(0.2))))
    drive(controller, run, 10)
    for start in (1e6, 0.0):
        phases = [each.phase for each in drive(controller, run, 5, first=10, start=start)]
        assert phases[0] == "holding" and phases[-1] == "moving"


def test_a_pose_is_not_followed_from_marks_that_are_frozen(one, run):
    made = one.at("task", rs.PBVS(one.task.goal)).with_(
        safety=rs.Safety(watchdog=rs.control.Watchdog(0.1))
    )
    controller = rs.Controller(made)
    drive(controller, run, 10)
    pixels = run.pixels.values[10].copy()
    pixels[3] = np.nan
    commands = [controller.step(pixels, run.q.values[10], t * DT) for t in range(10, 16)]
    assert [each.phase for each in commands] == ["moving"] * 2 + ["holding"] * 4
    assert commands[-1].health.lost == ("square[3]",)
    points = rs.Controller(one.with_(safety=rs.Safety(watchdog=rs.control.Watchdog(0.1))))
    drive(points, run, 10)
    commands = [points.step(pixels, run.q.values[10], t * DT) for t in range(10, 16)]
    assert {each.phase for each in commands} == {"moving"}  # of points three are enough


def test_an_unseen_target_has_not_arrived(one):
    controller, goal = rs.Controller(one), one.task.goal.q
    pixels = one.scene.view(goal).pixels
    assert controller.step(pixels, goal, 0.0).phase == "converged"
    gone = pixels.copy()
    gone[1:] = np.nan
    for t, seen in enumerate((gone, np.full((4, 2), np.nan), gone), 1):
        assert controller.step(seen, goal, t * DT).phase == "moving"
    assert controller.step(pixels, goal, 4 * DT).health.converged


def test_of_several_cameras_one_that_finds_nothing_has_lost_its_marks():
    made = rs.load_scenario(examples.path("stereo_in_hand"))
    run, controller = made.run(duration=0.4), rs.Controller(made)
    left, right = controller.cameras
    N = len(run.mark) // 2
    both, q = run.pixels.values[0], run.q.values[0]
    controller.step({left: both[:N], right: both[N:]}, q, 0.0)
    lost = controller.step({left: {}, right: both[N:]}, q, made.dt).health.lost
    assert lost == tuple(f"{left}: {controller.sights[0].target.name}[{i}]" for i in range(N))


@pytest.mark.parametrize(
    "given",
    [
        lambda p: rs.control.Marks(rs.control.Marks(p, 0.05), 0.05, doubtful=["square"]),
        lambda p: rs.control.Marks(
            {"square": rs.control.Marks(p, 0.05)}, 0.05, doubtful=["square"]
        ),
        lambda p: rs.control.Marks({"camera": {"square": p}}, 0.05, doubtful={"square"}),
    ],
)
def test_a_doubtful_mark_is_doubtful_however_deep(one, run, given):
    controller = rs.Controller(one)
    drive(controller, run, 1)
    command = controller.step(given(run.pixels.values[1]), run.q.values[1], 0.05)
    assert command.health.unused == ("doubtful square",) and len(command.health.lost) == 4


def test_a_doubtful_name_that_is_none_of_the_targets_is_reported(one, run):
    controller = rs.Controller(one)
    odd = rs.control.Marks(run.pixels.values[0], 0.0, doubtful=["sqare"])
    assert controller.step(odd, run.q.values[0], 0.0).health.unused == ("doubtful sqare",)


def test_joints_in_another_unit_are_a_fault():
    arm = rs.load_scenario(examples.path("eye_in_hand"))
    controller, pixels = rs.Controller(arm), arm.scene.view(arm.start, points="plate").pixels
    assert controller.step(pixels, arm.start, 0.0).phase == "moving"
    fault = controller.step(pixels, np.degrees(arm.start), 0.04).health.fault
    assert "joint 'link1' is -13 rad, far outside its limits [-2.8973, 2.8973]" in fault
    with pytest.raises(rs.errors.InputError, match="far outside its limits"):
        rs.Controller(arm).step(pixels, np.degrees(arm.start), 0.0)


def test_a_command_cannot_be_changed(one, run):
    command = drive(rs.Controller(one), run, 1)[0]
    for array in (command.velocities, command.error):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 1e3


@pytest.mark.parametrize("scheme", ["broyden", "estimated"])
def test_pixels_that_are_none_leave_no_trace(one, run, scheme):
    controller = rs.Controller(one.at(REMEMBERS[scheme]))
    drive(controller, run, 10)
    wild = run.pixels.values[10] * 1e160
    assert len(controller.step(wild, run.q.values[10], 10 * DT).health.lost) == 4
    after = drive(controller, run, 30, first=11)
    assert after[-1].phase == "moving" and np.abs(after[-1].velocities).max() < 1.0


def test_a_law_that_fails_brakes_the_robot_within_its_limits(one, run):
    class Fails:
        in_camera, bad = False, False

        def command(self, state):
            if Fails.bad:
                raise ZeroDivisionError("oops")
            return -state.gain * np.linalg.lstsq(state.task_jacobian[0], state.error[0])[0][None]

    made = one.at("task.law", Fails()).with_(safety=rs.Safety(acceleration=0.3))
    controller = rs.Controller(made)
    commands = drive(controller, run, 20)
    Fails.bad = True
    bad = drive(controller, run, 10, first=20)
    assert {each.phase for each in bad} == {"holding"} and bad[0].health.fault == "oops"
    Fails.bad = False
    every = np.array([c.velocities for c in [*commands, *bad, *drive(controller, run, 5, 30)]])
    assert np.abs(np.diff(every, axis=0)).max() <= 0.3 * DT * (1 + 1e-9)
    assert 0 < np.abs(every[29]).max() < np.abs(every[19]).max()


def test_a_law_that_fails_stops_a_robot_without_limits_at_once(one, run):
    class Fails:
        in_camera = False

        def command(self, state):
            if state.time > 0.5:
                raise ZeroDivisionError("oops")
            return -state.gain * np.linalg.lstsq(state.task_jacobian[0], state.error[0])[0][None]

    commands = drive(rs.Controller(one.at("task.law", Fails())), run, 20)
    assert commands[12].velocities.any() and commands[13].phase == "holding"
    assert not any(command.velocities.any() for command in commands[13:])


def test_a_command_that_was_not_finite_once_is_braked_and_forgotten(one, run):
    class Leaps:
        in_camera, bad = False, False

        def command(self, state):
            qd = -state.gain * np.linalg.lstsq(state.task_jacobian[0], state.error[0])[0][None]
            return qd / (0.0 if Leaps.bad else 1.0)

    made = one.at("task.law", Leaps()).with_(safety=rs.Safety(acceleration=0.3))
    controller = rs.Controller(made)
    commands = drive(controller, run, 20)
    Leaps.bad = True
    with np.errstate(divide="ignore"):
        commands += drive(controller, run, 2, first=20)
    Leaps.bad = False
    commands += drive(controller, run, 10, first=22)
    assert [each.phase for each in commands[19:25]] == ["moving", *["holding"] * 3, *["moving"] * 2]
    every = np.array([each.velocities for each in commands])
    assert np.abs(np.diff(every, axis=0)).max() <= 0.3 * DT * (1 + 1e-9)


LOOP = {}
LOOP["camera"] = LOOP
ODDER = [
    LOOP,
    {
        "square": rs.control.Marks(
            rs.control.Marks(rs.control.Marks(rs.control.Marks(None, 0), 0), 0), 0
        )
    },
    {1.5: 2},
    b"x",
]


@pytest.mark.parametrize("given", ODDER, ids=range(len(ODDER)))
def test_odd_containers_are_reported_in_a_line(one, run, given):
    controller = rs.Controller(one)
    drive(controller, run, 3)
    command = controller.step(given, run.q.values[3], 3 * DT)
    assert command.phase == "holding" and 0 < len(command.health.fault) < 300
    assert drive(controller, run, 1, first=4)[0].phase == "moving"
    with pytest.raises(rs.errors.InputError):
        rs.Controller(one).step(given, run.q.values[0], 0.0)


def test_a_fault_is_of_one_call(one, run):
    controller = rs.Controller(one)
    drive(controller, run, 3)
    assert controller.step("x", run.q.values[3], 3 * DT).health.fault
    same = controller.step(run.pixels.values[3], run.q.values[3], 3.1 * DT)
    assert same.health.fault == "" and same.phase == "holding"


def test_why_it_holds_is_reported(one, run):
    controller = rs.Controller(one.with_(safety=rs.Safety(hold_to_run=True)))
    assert drive(controller, run, 1)[0].health.limits == ("not released",)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
@pytest.mark.parametrize("start", [0.0, 123.456, 1.7e9])
def test_a_watchdog_of_whole_periods_agrees_with_the_simulation(one, k, start):
    made = one.with_(
        sensing=rs.Sensing(period=5 * DT), safety=rs.Safety(watchdog=rs.control.Watchdog(k * DT))
    ).with_(duration=1.6)
    run, controller = made.run(), rs.Controller(made)
    (sight,) = controller.sights
    for t in range(41):
        q = run.q.values[t]
        pixels = sight.project(q[:, None]).pixels[..., 0] if t % 5 == 0 else None
        command = controller.step(pixels, q, start + t * DT)
        np.testing.assert_array_equal(command.velocities, run.qd.values[t])
        assert command.phase == ("holding" if t % 5 > k else "moving")


@pytest.mark.parametrize(
    ("safety", "words"),
    [
        (lambda: rs.Safety(margin=2.0), "margin: 2 leaves no room to"),
        (
            lambda: rs.Safety(fence=rs.control.Fence("plate", (0, 0, 0), (1, 1, 1))),
            "no joint moves",
        ),
        (lambda: rs.Safety(fence=rs.control.Fence("nix", (0, 0, 0), (1, 1, 1))), "no frame 'nix'"),
    ],
)
def test_a_safety_that_cannot_be_is_refused(safety, words):
    arm = rs.load_scenario(examples.path("eye_in_hand"))
    with pytest.raises(rs.errors.InputError, match=words):
        arm.with_(safety=safety())
