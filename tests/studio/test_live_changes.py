"""Changes during a run: pulled targets, pushed robots, changes after an end, and the history."""

from __future__ import annotations

import math
import os
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from studio.page_model import PageModel

from robsim import Experiment, Outcome, Pose, examples, load_scenario
from robsim.errors import InputError
from robsim.studio import edit_history, live_run, workbench
from robsim.studio import session as session_module
from robsim.studio.refusal_reasons import convert_radians
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench

FAR, TURNED = 1e-3, 0.1  # largest distance in metres and angle in degrees from the first pose


def open_bench(name, **changes):
    return Workbench(load_scenario(examples.path(name)).with_(**changes))


def advance(bench, seconds=math.inf):
    """Simulate for some seconds, or until the run has ended or rests."""
    until = bench.time + seconds - 1e-9
    while bench.time < until and not bench.idle:
        bench.step()


def relative_pose(bench, target):
    scene, q = bench.experiment.scene, bench.pair.live.now.q
    return scene.pose("camera", q).inv() @ scene.pose(target, q)


def handle_pose(bench, name):
    return next(each.pose for each in bench.handles if each.name == name)


def pose_in_figure(bench, frame):
    scene, q = bench.experiment.scene, bench.pair.live.now.q
    return scene.display @ scene.pose(frame, q)


def numbers_of(T):
    return [*T.position.tolist(), *T.quaternion.tolist()]


def assert_same_pose(a, b):
    away = a.inv() @ b
    assert np.linalg.norm(away.position) < FAR
    assert math.degrees(np.linalg.norm(away.rotvec)) < TURNED


PULLS = {  # handle, target, and the motion of the handle
    "eye_in_hand": ("objects.plate", "plate", Pose.at(0.05, 0.03, -0.02)),
    "chapter_6_1": ("objects.cube", "cube", Pose.at(0.008, -0.006, 0.0)),
    "eye_to_hand": ("cameras.camera", "plate", Pose.at(0.04, 0.04, 0.0)),
    "holonomic": ("objects.board", "board", Pose.at(0.06, -0.05, 0.0)),
}


@pytest.mark.parametrize("name", PULLS)
def test_the_robot_follows_a_pulled_body(name):
    handle, target, motion = PULLS[name]
    bench = open_bench(name)
    advance(bench)
    assert bench.rests and bench.pair.end.outcome == Outcome.CONVERGED
    first, then = relative_pose(bench, target), bench.time
    pose = handle_pose(bench, handle)
    bench.drag(handle, numbers_of(motion @ Pose.from_quaternion(pose[:3], pose[3:])))
    assert bench.since == then and bench.keeps_goals and not bench.idle
    advance(bench, 5.0)
    assert_same_pose(first, relative_pose(bench, target))


def test_the_robot_follows_a_turned_body():
    bench = open_bench("eye_in_hand")
    advance(bench)
    first, pose = relative_pose(bench, "plate"), handle_pose(bench, "objects.plate")
    turned = Pose.from_quaternion(pose[:3], pose[3:]) @ Pose.at(rotvec=[0.0, 0.0, 0.25])
    bench.set("objects.plate.rotvec", turned.rotvec.tolist())  # a slider acts like a drag
    advance(bench, 5.0)
    assert_same_pose(first, relative_pose(bench, "plate"))


@pytest.mark.parametrize(
    ("name", "handle", "target"),
    [
        ("eye_in_hand", "cameras.camera", "plate"),
        ("eye_to_hand", "objects.plate", "plate"),
        ("holonomic", "cameras.camera", "board"),
    ],
)
def test_a_pushed_robot_returns(name, handle, target):
    bench = open_bench(name)
    assert handle not in [each.name for each in bench.handles]  # at the start: "start" alone
    advance(bench)
    experiment, first = bench.experiment, relative_pose(bench, target)
    frame = handle.partition(".")[2]
    before = pose_in_figure(bench, frame)
    bench.drag(handle, numbers_of(Pose.at(0.03, -0.02, 0.0) @ before))
    pushed = pose_in_figure(bench, frame)
    assert pushed.position - before.position == pytest.approx([0.03, -0.02, 0.0], abs=1e-6)
    assert bench.experiment is experiment and not bench.edited
    advance(bench, 5.0)
    assert_same_pose(first, relative_pose(bench, target))
    bench.reset()
    assert np.array_equal(bench.pair.live.now.q, experiment.start)


def test_a_vehicle_is_turned_and_pushed_in_its_plane():
    bench = open_bench("unicycle_docking")
    bench.step()
    before = pose_in_figure(bench, "camera")
    turn = Pose.at(rpy=[0.0, 0.0, 0.2])
    wanted = Pose(np.vstack([np.c_[(turn @ before).rotation, before.position], [0, 0, 0, 1]]))
    bench.drag("cameras.camera", numbers_of(wanted))
    assert np.allclose(pose_in_figure(bench, "camera").matrix, wanted.matrix, rtol=0, atol=1e-9)


def test_a_low_gain_is_the_reason_for_a_late_return():
    bench = open_bench("visp_tutorial")
    advance(bench)
    pose = handle_pose(bench, "objects.square")
    then = bench.time
    bench.drag("objects.square", [pose[0] + 0.036, *pose[1:]])
    # e falls as exp(-0.5 t): from 36 mm to 1 mm in ln(36) / 0.5 = 7.17 s
    assert "about 7.2 s" in bench.return_remark and "0.5 1/s" in bench.return_remark
    while bench.pair.live.measure_distance()[0] > FAR:
        bench.step()
    assert bench.time - then == pytest.approx(7.2, abs=0.4)


def test_a_run_rests_a_second_after_convergence():
    bench = open_bench("visp_tutorial")
    advance(bench)
    assert bench.time == pytest.approx(bench.pair.end.time + live_run.REST)
    count = len(bench.pair.live.instants)
    bench.step()
    assert len(bench.pair.live.instants) == count


def test_a_run_with_a_moving_target_goes_on_to_its_duration():
    name = "pan_tilt_tracking"
    bench = open_bench(name)
    assert bench.experiment.scene.motions
    advance(bench)
    assert bench.time == pytest.approx(bench.experiment.duration)


def test_the_time_limit_counts_from_the_last_change():
    bench = open_bench("visp_tutorial", duration=2.0)
    advance(bench, 1.6)
    bench.set("task.gain", 0.6)
    advance(bench, 1.6)
    assert not bench.idle
    advance(bench)
    assert bench.pair.end.outcome == Outcome.TIME_LIMIT and bench.time == pytest.approx(3.6)


def test_a_change_that_ended_the_run_at_once_can_be_taken_back():
    bench = open_bench("chapter_6_1")
    advance(bench)
    pose = handle_pose(bench, "objects.cube")
    first = relative_pose(bench, "cube")
    bench.drag("objects.cube", [pose[0] + 0.1, *pose[1:]])
    assert bench.pair.end.outcome == Outcome.OUT_OF_IMAGE
    bench.drag("objects.cube", [pose[0] + 0.005, *pose[1:]])
    assert bench.restarts == 0 and not bench.idle
    advance(bench, 5.0)
    assert_same_pose(first, relative_pose(bench, "cube"))


def test_a_change_after_the_time_limit_starts_over():
    bench = open_bench("visp_tutorial", duration=1.0)
    advance(bench)
    bench.set("task.gain", 0.8)
    assert bench.restarts == 1 and bench.time == bench.since == 0.0
    assert bench.restarted_because == "the run had ended: time limit after 1 s"
    assert bench.experiment.task.gain == 0.8


def test_a_value_that_is_invalid_by_itself_is_refused_after_an_end():
    bench = open_bench("visp_tutorial", duration=1.0)
    advance(bench)
    with pytest.raises(InputError, match="greater than 0"):
        bench.set("task.gain", -1.0)
    assert bench.restarts == 0 and bench.ended and bench.history.before is None


def test_several_values_change_at_once_or_not_at_all():
    bench = open_bench("visp_tutorial")
    bench.change({"task.interaction": "desired", "run.duration": "30 s", "task.gain": 0.7})
    task = bench.experiment.task
    assert (task.interaction, task.gain, bench.experiment.duration) == ("desired", 0.7, 30.0)
    bench.undo()
    assert not bench.edited
    for values in ({"task.gain": 0.7, "task.gian": 1}, {}, None, [1], {"robots.0.urdf": "x"}):
        with pytest.raises(InputError):
            bench.change(values)
    assert not bench.edited


def test_undo_and_redo_restore_experiments_and_the_second_scheme(monkeypatch):
    monkeypatch.setattr(edit_history, "PAUSE", 0.0)
    bench = open_bench("eye_in_hand", duration=2.0)
    advance(bench, 0.4)
    seen = [(bench.experiment, dict(bench.second))]
    pose = handle_pose(bench, "objects.plate")
    for edit in (
        lambda: bench.set("task.gain", 2.0),
        lambda: bench.drag("objects.plate", [pose[0] + 0.02, *pose[1:]]),
        lambda: bench.compare(["task.gain", 0.3]),
        lambda: bench.set("sensing.noise", 0.5),
        lambda: bench.show_goal("anew"),
    ):
        edit()
        bench.step()
        seen.append((bench.experiment, dict(bench.second)))
    for experiment, second in reversed(seen[:-1]):
        bench.undo()
        assert bench.experiment == experiment and bench.second == second
        bench.step()
    with pytest.raises(InputError, match="nothing has been changed"):
        bench.undo()
    for experiment, second in seen[1:]:
        bench.redo()
        assert bench.experiment == experiment and bench.second == second
    bench.restore_original()
    assert not bench.edited and bench.differences == [] and not bench.second
    bench.undo()
    assert bench.experiment == seen[-1][0]


def test_undo_after_changes_of_truth_and_belief(monkeypatch):
    monkeypatch.setattr(edit_history, "PAUSE", 0.0)
    bench = open_bench("calibration_errors")
    x, y, z = bench.controls["objects.square.position"].value
    bench.set("objects.square.position", [x + 0.01, y, z])
    bench.set("belief.cameras.camera.focal", [555.0, 550.0])
    bench.undo()
    assert bench.controls["belief.cameras.camera.focal"].value == [550.0, 550.0]
    assert bench.controls["objects.square.position"].value == [x + 0.01, y, z]
    bench.undo()
    assert not bench.edited


def test_a_drag_is_one_edit():
    bench = open_bench("eye_in_hand")
    pose = handle_pose(bench, "objects.plate")
    for i in range(5):
        bench.drag("objects.plate", [pose[0] + 0.002 * i, *pose[1:]])
        bench.step()
    bench.set("task.gain", 2.0)
    bench.undo()
    (change,) = bench.differences
    assert change == {
        "path": "objects.plate.position",
        "before": "31, 0, 10 cm",
        "after": "31.8, 0, 10 cm",
        "original": [0.31, 0.0, 0.1],
    }
    bench.undo()
    assert not bench.edited and bench.history.before is None


def test_a_stroke_of_the_pointer_is_one_edit_whatever_its_pauses(monkeypatch):
    monkeypatch.setattr(edit_history, "PAUSE", 0.0)
    bench = open_bench("eye_in_hand")
    pose = handle_pose(bench, "objects.plate")
    for stroke, x in [("a 1", 0.01), ("a 1", 0.02), ("a 2", 0.03), ("a 2", 0.04)]:
        bench.drag("objects.plate", [pose[0] + x, *pose[1:]], stroke)
        bench.set("task.gain", 2 + x, stroke) if x == 0.04 else None
    bench.set("task.gain", 3.0, "a 3")
    bench.set("task.gain", 4.0, "a 3")
    seen = []
    while bench.history.before:
        bench.undo()
        seen.append((bench.experiment.task.gain, handle_pose(bench, "objects.plate")[0] - pose[0]))
    assert np.allclose(seen, [(2.04, 0.04), (1, 0.04), (1, 0.02), (1, 0)])


def test_the_original_starts_over():
    bench = open_bench("visp_tutorial")
    bench.set("task.gain", 2.0)
    advance(bench)
    assert bench.rests
    bench.restore_original()
    assert (bench.time, bench.since, bench.idle) == (0.0, 0.0, False)
    assert (bench.restarts, bench.restarted_because) == (1, "back to the original")
    advance(bench)
    assert bench.pair.end.time == pytest.approx(float(bench.experiment.run()["end_time"]))


def test_a_reset_keeps_the_reason_of_a_change_that_started_over():
    bench = open_bench("visp_tutorial", duration=1.0)
    advance(bench)
    bench.change({"task.gain": 0.8})
    bench.reset()
    assert bench.restarts == 1 and bench.restarted_because.startswith("the run had ended: ")


def test_the_history_forgets_the_earliest_edits(monkeypatch):
    monkeypatch.setattr(edit_history, "MOST_EDITS", 3)
    monkeypatch.setattr(edit_history, "PAUSE", 0.0)
    bench = open_bench("visp_tutorial")
    for gain in (1.0, 2.0, 3.0, 4.0, 5.0):
        bench.set("task.gain", gain)
    for gain in (4.0, 3.0, 2.0):
        bench.undo()
        assert bench.experiment.task.gain == gain
    assert bench.history.before is None
    bench.restore_original()
    assert bench.experiment.task.gain == 0.5


def test_the_goal_is_shown_anew_and_here():
    bench = open_bench("eye_in_hand")
    advance(bench)
    pose = handle_pose(bench, "objects.plate")
    bench.drag("objects.plate", [pose[0] + 0.04, *pose[1:]])
    assert bench.keeps_goals and bench.has_shown_goals
    bench.show_goal("anew")  # at the goal's q: the arm is there already
    assert not bench.keeps_goals
    assert bench.pair.live.measure_distance()[0] < 1e-5
    bench.drag("cameras.camera", numbers_of(Pose.at(0.03) @ pose_in_figure(bench, "camera")))
    here = bench.pair.live.now.q
    bench.show_goal("here")
    assert np.array_equal(bench.experiment.task.goal.q, here)
    advance(bench)
    assert np.allclose(bench.pair.live.now.q, here, rtol=0, atol=1e-9)
    with pytest.raises(InputError, match="no goal that is shown"):
        open_bench("calibration_errors").show_goal("anew")


def drag_target(bench):
    pose = handle_pose(bench, "objects.plate")
    bench.drag("objects.plate", [pose[0] + 0.02, pose[1] - 0.01, *pose[2:]])


def push_camera(bench):
    bench.drag("cameras.camera", numbers_of(Pose.at(0.02) @ pose_in_figure(bench, "camera")))


def change_and_undo(bench):
    bench.set("task.gain", 3.0)
    advance(bench, 0.2)
    bench.undo()


EDITS = {
    "gain": lambda bench: bench.set("task.gain", 1.7),
    "features": lambda bench: bench.set("task.features", "lines"),
    "interaction": lambda bench: bench.set("task.interaction", "current"),
    "belief": lambda bench: bench.set("belief.cameras.camera.focal", [460.0, 480.0]),
    "noise": lambda bench: bench.set("sensing.noise", 0.3),
    "scheme": lambda bench: bench.set("task.kind", "pbvs"),
    "target": drag_target,
    "push": push_camera,
    "undo": change_and_undo,
}


@pytest.mark.parametrize("edit", EDITS)
def test_the_saved_experiment_is_the_run_since_the_last_change(edit):
    bench = open_bench("eye_in_hand", duration=2.0)
    advance(bench, 0.8)
    EDITS[edit](bench)
    assert bench.since == pytest.approx(1.0 if edit == "undo" else 0.8)
    advance(bench, 1.2)
    live = [each.q for each in bench.pair.live.instants if each.time >= bench.since]
    saved = Experiment.from_text(bench.saved_experiment().text)
    assert np.array_equal(saved.run()["q"].values[: len(live)], live)


def test_without_a_change_during_the_run_the_saved_experiment_is_the_experiment():
    bench = open_bench("eye_in_hand")
    bench.set("task.gain", 2.0)
    advance(bench, 0.4)
    assert (
        bench.saved_experiment()
        == bench.experiment
        == bench.history.original.experiment.at("task.gain", 2.0)
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("got '-10000.0 rad'", "got '-5.73e+05 deg'"),
        ("limits [-2.8973, 2.8973] rad", "limits [-166, 166] deg"),
        ("from -1 to 2 rad/s, 0.1 rad/s^2", "from -57.3 to 114.6 deg/s, 5.73 deg/s^2"),
        ("1.5707963267948966 rad", "90 deg"),
        ("3 m and 2 radians of 4 grad", "3 m and 2 radians of 4 grad"),
        ("q1 rad", "q1 rad"),
    ],
)
def test_angles_of_messages_are_in_degrees(text, expected):
    assert convert_radians(text) == expected


def measure_resident_memory():
    """Return the resident memory of this process in MB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.full
def test_memory_stays_bounded_while_a_hand_moves(monkeypatch):
    """18,000 changes are 15 minutes of a hand that sends 20 values a second."""
    count = int(os.environ.get("ROBSIM_TEST_CHANGES", "600"))
    now = [0.0]
    monkeypatch.setattr(edit_history.time, "monotonic", lambda: now[0])
    session = Session(open_bench("eye_in_hand"), ScenarioShelf([]))
    bench, used, largest = session.bench, [], 0
    for i in range(count):
        now[0] += 0.05
        share = (i % 60) / 60 - 0.5
        pose = handle_pose(bench, "objects.plate")
        request = (
            {"set": ["task.gain", 1.0 + share]},
            {"drag": ["objects.plate", [0.31 + 0.03 * share, 0.02 * share, *pose[2:]]]},
            {"undo": True} if i % 2 else {"redo": True},
        )[i // 60 % 3]
        session.do(request)
        bench.step()
        messages = list(session.outgoing.news(session, bench, session.shelf))
        largest = max([largest, *map(len, messages)] if i else [0])
        if i % 200 == 199:
            used.append(measure_resident_memory())
    assert largest < 64 * 1024
    print(f"largest message {largest} bytes, memory {used[0]:.0f} to {used[-1]:.0f} MB")
    assert used[-1] - used[0] < 24.0  # an instant has 2 kB


def test_the_oldest_instants_are_forgotten_and_the_run_goes_on(monkeypatch):
    monkeypatch.setattr(workbench, "MOST", 40)
    monkeypatch.setattr(workbench, "KEPT", 10)
    session = Session(open_bench("visp_tutorial"), ScenarioShelf([]))
    bench = session.bench
    page = PageModel(session.outgoing.news(session, bench, session.shelf))
    for _ in range(60):
        bench.step()
        page.hear(session.outgoing.news(session, bench, session.shelf))
    times = [each.time for each in bench.pair.live.instants]
    assert len(times) < 40 and times[-1] == pytest.approx(60 * 0.04) and not bench.ended
    assert page.arrays["time"].tolist() == pytest.approx(times)


def test_a_request_is_answered_before_the_next_tick(monkeypatch):
    monkeypatch.setattr(session_module, "TICK", 60.0)
    session = Session(open_bench("visp_tutorial"), ScenarioShelf([]))
    answered = threading.Event()
    session.start()
    session.broadcast = lambda message: answered.set() if '"values"' in message else None
    session.receive({"set": ["task.gain", 0.9]})
    assert answered.wait(20.0) and session.bench.experiment.task.gain == 0.9
    session.close()


def test_a_failure_after_convergence_is_the_failure_of_the_files():
    """A gain of 200 breaks a run that rests; its saved experiment ends alike."""
    bench = Workbench(load_scenario(examples.path("eye_in_hand")))
    while not bench.idle:
        bench.step()
    bench.set("task.gain", 200)
    while not bench.idle:
        bench.step()
    end, run = bench.pair.end, bench.saved_experiment().run()
    assert end.outcome == Outcome.JOINT_LIMIT == int(run["outcome"])
    assert float(run["end_time"]) == pytest.approx(end.time - bench.since, abs=1e-9)


def test_a_failure_soon_after_convergence_is_the_failure_of_the_files():
    """An unstable run begins within its tolerance and breaks a second later."""
    experiment = load_scenario(examples.path("eye_in_hand"))
    goal = experiment.run()["q_end"].values
    bench = Workbench(experiment.with_(start=goal).at({"task.gain": 90.0, "task.tolerance": 1.0}))
    bench.step()
    assert bench.pair.end.outcome == Outcome.CONVERGED and bench.saved_experiment().hold is False
    advance(bench)
    end, saved = bench.pair.end, Experiment.from_text(bench.saved_experiment().text)
    assert end.outcome == Outcome.JOINT_LIMIT and end.time < live_run.REST and bench.since == 0.0
    run = saved.run()
    assert int(run["outcome"]) == Outcome.JOINT_LIMIT and float(run["end_time"]) == end.time
    live = [each.q for each in bench.pair.live.instants]
    assert np.array_equal(run["q"].values[: len(live)], live)


def test_a_stall_soon_after_convergence_does_not_end_a_run():
    """The judgement of a run with `hold` has neither stalls nor a bound of the error."""
    bench = open_bench("eye_in_hand")
    advance(bench, 0.4)
    live = bench.pair.live
    live.decision = replace(live.now, outcome=Outcome.CONVERGED)
    late = replace(live.now, outcome=Outcome.LOCAL_MINIMUM)
    live._decide_late_failure(late, len(live.instants) - 1)
    assert live.decision.outcome == Outcome.CONVERGED and live.segment.hold
    before = live.now.q
    bench.step()
    assert not bench.ended and not np.array_equal(live.now.q, before)
    saved = bench.saved_experiment().run()["q"].values
    assert np.array_equal(saved[: len(live.instants)], [each.q for each in live.instants])


def test_a_dragged_target_moves_a_run_from_its_local_minimum():
    bench = Workbench(load_scenario(examples.path("local_minimum")))
    while not bench.idle:
        bench.step()
    assert bench.pair.end.outcome == Outcome.LOCAL_MINIMUM
    q, handle = bench.pair.live.now.q, next(h for h in bench.handles if "objects" in h.name)
    bench.drag(handle.name, [handle.pose[0] + 0.05, *handle.pose[1:]])
    assert bench.since > 0.0 and bench.restarts == 0
    assert bench.pair.live.now.q.tolist() == q.tolist()
