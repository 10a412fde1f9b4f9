"""An experiment on the bench: changed on its way, dragged, and beside a second scheme."""

from __future__ import annotations

import numpy as np
import pytest

from robsim import Outcome, Pose, examples, load_scenario
from robsim.errors import InputError
from robsim.studio.live_explanation import explain_live_run
from robsim.studio.workbench import Workbench


@pytest.fixture
def experiment():
    return load_scenario(examples.path("visp_tutorial"))


def through(bench):
    while not bench.idle:
        bench.step()
    return np.array([each.q for each in bench.pair.live.instants])


def test_the_run_on_the_bench_is_the_run_of_the_experiment(experiment):
    bench = Workbench(experiment)
    q = through(bench)
    run = experiment.run()
    count = int(np.isfinite(run["error_norm"]).sum())
    assert np.array_equal(q[:count], run["q"].values[:count])
    end = bench.pair.end
    assert end.outcome == Outcome.CONVERGED and end.time == float(run["end_time"])
    shown = bench.recording()
    assert np.array_equal(shown.arrays["camera.pixels"][:count], run["pixels"].values[:count])
    twist = run["camera_velocity"].values[:count]
    assert np.array_equal(shown.arrays["curve camera v"][:count], twist[:, :3])


def test_a_change_on_the_way_goes_on_from_there(experiment):
    bench = Workbench(experiment)
    for _ in range(20):
        bench.step()
    here = bench.pair.live.now
    bench.set("task.gain", 2.0)
    assert bench.time == here.time and len(bench.pair.live.instants) == 21
    q = through(bench)[20:]
    expected = experiment.with_(start=here.q).at("task.gain", 2.0).run()["q"].values
    expected = expected[np.isfinite(expected).all(axis=1)]
    assert np.allclose(q[: len(expected)], expected, rtol=0, atol=1e-13)
    assert bench.changes == {"task.kind": "ibvs", "task.gain": 2.0}
    assert bench.experiment == experiment.at("task.gain", 2.0)


def test_a_start_that_is_changed_begins_anew(experiment):
    bench = Workbench(experiment)
    for _ in range(5):
        bench.step()
    bench.set("start.position", [0.1, 0.0, -1.0])
    assert bench.time == 0.0 and bench.pair.live.now.q[:3].tolist() == [0.1, 0.0, -1.0]


def test_other_features_begin_a_new_table(experiment):
    bench = Workbench(experiment)
    for _ in range(5):
        bench.step()
    bench.set("task.kind", "pbvs")
    assert bench.recording().arrays["curve error"].shape == (1, 7)
    assert bench.time == pytest.approx(0.2)


def test_the_target_is_dragged_and_the_goal_follows_it(experiment):
    bench = Workbench(experiment)
    handle = next(each for each in bench.handles if each.name == "objects.square")
    before = np.array(next(each.pose for each in bench.handles if each.name == "goal"))
    bench.drag("objects.square", [handle.pose[0] + 0.05, *handle.pose[1:]])
    place = bench.experiment.scene.objects[0].pose
    assert np.allclose(place.position, [0.05, 0.0, 0.0], rtol=0, atol=1e-12)
    goal = np.array(next(each.pose for each in bench.handles if each.name == "goal"))
    assert np.allclose(goal - before, [0.05, 0, 0, 0, 0, 0, 0], rtol=0, atol=1e-9)
    through(bench)
    end = bench.pair.live.now
    away = end.pixels - bench.pair.live.template["pixels_goal"].values
    assert bench.pair.end.outcome == Outcome.CONVERGED and np.abs(away).max() < 0.05


def test_the_start_of_an_arm_is_dragged_by_its_hand():
    experiment = load_scenario(examples.path("eye_in_hand"))
    bench = Workbench(experiment)
    pose = next(each.pose for each in bench.handles if each.name == "start")
    wanted = [pose[0] - 0.03, pose[1] + 0.02, *pose[2:]]
    bench.drag("start", wanted)
    there = bench.experiment.scene.pose("camera", bench.experiment.start)
    assert np.allclose(there.position, wanted[:3], atol=1e-4)  # joints are rounded
    assert np.allclose(np.abs(there.quaternion @ wanted[3:]), 1.0)
    degrees = np.rad2deg(bench.experiment.start)
    assert np.allclose(degrees, np.round(degrees, 3), rtol=0, atol=1e-12)


def test_a_computed_goal_is_dragged():
    bench = Workbench(load_scenario(examples.path("calibration_errors")))
    pose = next(each.pose for each in bench.handles if each.name == "goal")
    bench.drag("goal", [pose[0], pose[1], pose[2] - 0.25, *pose[3:]])
    T_c_o = bench.experiment.task.goal.T_c_o
    mine = Pose.from_quaternion(pose[:3], pose[3:])
    assert T_c_o.position == pytest.approx((mine.inv() @ Pose.at(0, 0, 0.25)).position, abs=1e-9)


def test_a_second_scheme_runs_beside(experiment):
    bench = Workbench(experiment)
    bench.compare(["task.interaction", "desired"])
    through(bench)
    other = np.array([each.q for each in bench.pair.other.instants])
    run = experiment.at("task.interaction", "desired").run()["q"].values
    live = np.isfinite(run).all(axis=1)
    assert np.array_equal(other[: live.sum()], run[live])
    shown = bench.recording()
    errors = shown.arrays["curve image error"]
    assert errors.shape == (len(other), 2) and (errors[0] == errors[0, 0]).all()
    groups = {frame["group"] for frame in shown.header["frames"]}
    assert "second" in groups
    bench.compare(None)
    assert bench.pair.other is None


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("task.gain", "fast", "expected a number"),
        ("task.gain", True, "expected a number"),
        ("task.gain", -1.0, "greater than 0"),
        ("task.kind", "none of them", "one of its options"),
        ("start.position", [1.0, 2.0], "one number for each of its names"),
        ("run.hold", 1, "true or false"),
        ("run.seed", 1.5, "a whole number"),
        ("task.gian", 1.0, "did you mean 'task.gain'"),
        ([], 1.0, "no control"),
        ("task.features", "ellipse", "needs at least 5 marks"),
    ],
)
def test_a_faulty_change_changes_nothing(experiment, name, value, reason):
    bench = Workbench(experiment)
    bench.step()
    with pytest.raises(InputError, match=reason):
        bench.set(name, value)
    assert bench.experiment == experiment and bench.changes == {} and bench.time == 0.04
    bench.step()
    assert bench.time == 0.08


@pytest.mark.parametrize(
    "pose", [None, [0.0] * 7, [1e9] * 7, ["a"] * 7, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, True], [1.0]]
)
def test_a_drag_to_no_pose_is_refused(experiment, pose):
    bench = Workbench(experiment)
    with pytest.raises(InputError, match="drag: "):
        bench.drag("start", pose)
    with pytest.raises(InputError, match="no handle"):
        bench.drag("../../etc", [0.0] * 7)


def test_a_drag_out_of_reach_is_refused():
    bench = Workbench(load_scenario(examples.path("eye_in_hand")))
    with pytest.raises(InputError, match="camera does not reach this pose"):
        bench.drag("start", [5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def test_a_mission_is_played_as_a_whole():
    bench = Workbench(load_scenario(examples.path("inspection_a")))
    assert bench.pair is None and bench.ended
    with pytest.raises(InputError, match="step by step"):
        bench.compare(["task.kind", "ibvs"])
    assert bench.recording().arrays["time"][-1] > 30.0


def test_a_change_that_the_second_scheme_cannot_follow_changes_nothing(experiment):
    bench = Workbench(experiment)
    bench.compare(["task.features.tolerance", 2e-5])
    for _ in range(5):
        bench.step()
    with pytest.raises(InputError, match=r"differs in task\.features\.tolerance"):
        bench.set("task.kind", "pbvs")
    assert bench.experiment == bench.pair.live.experiment == experiment
    assert len(bench.pair.live.instants) == len(bench.pair.other.instants) == 6
    through(bench)


def test_the_end_agrees_with_the_first_scheme(experiment):
    bench = Workbench(experiment)
    bench.compare(["task.gain", 0.3])
    through(bench)
    end = float(experiment.run()["end_time"])
    assert bench.pair.end.time == pytest.approx(end) and bench.time > end + 1.0
    rest, late = (bench.pair.live.instants[i] for i in (535, -1))
    assert rest.time == pytest.approx(end + 1.0) and rest.qd.any()
    assert not late.qd.any() and np.array_equal(late.q, rest.q)


def test_two_schemes_have_one_period(experiment):
    with pytest.raises(InputError, match="step by step"):
        Workbench(experiment).compare(["run.dt", 0.01])


def test_a_file_that_is_gone_is_not_missed(experiment, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f"# Watch it.\n\n{experiment.text}")
    bench = Workbench(load_scenario(path))
    path.unlink()
    bench.set("task.gain", 2.0)
    bench.reset()
    assert [each["text"] for each in bench.why["watch"]] == ["Watch it."]


def test_the_explanation_covers_the_run_since_the_last_change(experiment):
    bench = Workbench(experiment)
    for _ in range(50):
        bench.step()
    bench.set("task.gain", 2.0)
    through(bench)
    bench.explain(explain_live_run(bench.experiment, bench.pair.live, trials=False))
    assert bench.texts["explanation"].startswith("The last change was at 2.00 s")
    assert bench.texts["experiment"] == experiment.at("task.gain", 2.0).text


def test_the_original_value_of_a_change_is_exact():
    experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 1 / 3)
    bench = Workbench(experiment)
    start = bench.controls["start.position"].value
    bench.set("task.gain", 2.0)
    bench.set("start.position", [0.1, *start[1:]])
    originals = {each["path"]: each["original"] for each in bench.differences}
    assert originals == {"task.gain": 1 / 3, "start.position": start}
    for path, value in originals.items():
        bench.set(path, value)
    assert bench.differences == [] and bench.experiment == experiment


def test_unchanged_parts_keep_their_controls():
    path = examples.path("second_robot")
    bench = Workbench(load_scenario(path))
    name, before = "robots.worker.links.forearm.dh.a", bench.controls
    bench.set(name, 0.4)
    fresh = load_scenario(path).at(bench.controls[name].changes(0.4))
    assert list(bench.controls.values()) == fresh.controls()
    kept = {each for each in before if bench.controls[each] is before[each]}
    assert "robots.watcher.home" in kept and "robots.worker.links.flange.dh.a" in kept
    assert name not in kept and "robots.worker.home" not in kept
