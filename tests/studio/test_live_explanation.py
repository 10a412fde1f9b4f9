"""The why of a run: the distance from the goal, and the changes that a page offers as buttons."""

from __future__ import annotations

import json

import numpy as np
import pytest

from robsim import Outcome, Pose, examples, load_scenario
from robsim.analysis.explanation.explanation import explain
from robsim.files.scenario_remark import extract_remark, list_remark_entries
from robsim.page.recordings import build_recording
from robsim.studio.live_explanation import (
    add_search_note,
    build_change_actions,
    explain_live_run,
    find_second_scheme,
    list_watch_entries,
)
from robsim.studio.workbench import Workbench

COMMANDS = 78  # commands in the remarks of all shipped experiments
NO_BUTTON = {"local_minimum": "robsim study", "straight_image_lines": "robsim run visp_tutorial"}


def explained(bench, trials=True):
    while not bench.idle:
        bench.step()
    bench.explain(explain_live_run(bench.experiment, bench.pair.live, trials))
    return bench.why


def labels(entries):
    return [action["label"] for each in entries for action in each["actions"]]


def test_the_headline_has_the_true_distance_from_the_goal():
    """The oracle is the scene at the last coordinates and at those of the shown goal."""
    bench = Workbench(load_scenario(examples.path("local_minimum")))
    why = explained(bench)
    scene, goal = bench.experiment.scene, bench.experiment.task.goal.q
    at = [scene.pose("camera", q) for q in (bench.pair.live.now.q, goal)]
    away: Pose = at[0].inv() @ at[1]
    centimetres = 100 * np.linalg.norm(away.position)
    degrees = np.degrees(np.linalg.norm(away.rotvec))
    assert why["headline"] == (
        f"missed the goal by {centimetres:.0f} cm and {degrees:.0f} deg: "
        f"local minimum after {bench.time:.1f} s"
    )
    assert (f"{centimetres:.0f}", f"{degrees:.0f}") == ("55", "32") and why["missed"]


def test_the_advice_of_a_failure_comes_as_buttons():
    bench = Workbench(load_scenario(examples.path("local_minimum")))
    why = explained(bench)
    assert [each["head"] for each in why["findings"]] == ["", "Why", "Try", "Try", "Try"]
    assert labels(why["findings"]) == [
        *("Try L mean", "beside it", "Try L desired", "beside it", "Try PBVS", "beside it")
    ]
    first, beside = why["findings"][2]["actions"]
    assert first["change"] == beside["second"] == {"task.interaction": "mean"}
    tried = bench.experiment.at(first["change"]).run()
    assert Outcome(int(tried.outcome)) == Outcome.CONVERGED
    bench.compare(list(*beside["second"].items()))
    assert bench.second == {"task.interaction": "mean"}


@pytest.mark.parametrize(
    ("name", "missed", "headline"),
    [
        (
            *("visp_tutorial", False),
            "converged after 20.4 s, less than 0.1 mm and 0.01 deg from the goal",
        ),
        (*("calibration_errors", True), "converged after 11 s, 9.1 cm and 0.01 deg from the goal"),
        ("watching_head", False, "converged, held for 18 s"),
        (
            *("desired_through_the_target", True),
            "missed the goal by 1.02 m and 107 deg: behind camera after 0.368 s",
        ),
    ],
)
def test_the_headline_of_a_run(name, missed, headline):
    why = explained(Workbench(load_scenario(examples.path(name))), trials=False)
    assert (why["missed"], why["headline"]) == (missed, headline)


def test_a_failure_without_a_goal_pose_has_its_remaining_error():
    experiment = load_scenario(examples.path("watching_head"))
    bench = Workbench(experiment.at({"run.hold": False, "task.feed_forward": "none"}))
    why = explained(bench, trials=False)
    error = np.abs(bench.pair.live.now.error)
    assert why["headline"] == (
        f"missed the goal by an error of {error.max():.2g}: time limit after 18 s"
    )


def test_times_count_from_the_last_change_but_in_the_headline():
    bench = Workbench(load_scenario(examples.path("local_minimum")))
    for _ in range(50):
        bench.step()
    bench.set("task.gain", 2.0)
    why = explained(bench, trials=False)
    assert why["headline"].endswith(f"local minimum after {bench.time:.3g} s")
    note, what = (each["text"] for each in why["findings"][:2])
    assert note == "The last change was at 1.00 s; the times below count from there."
    assert what.startswith(f"After {bench.time - 1:.4g} s the robot stands still")


def test_a_change_that_fails_at_once_is_the_cause_and_can_be_taken_back():
    bench = Workbench(load_scenario(examples.path("chapter_6_1")))
    while not bench.idle:
        bench.step()
    pose = next(each.pose for each in bench.handles if each.name == "objects.cube")
    bench.drag("objects.cube", [pose[0] + 0.2, *pose[1:]])
    what, why, advice = explained(bench)["findings"]
    assert what["text"].startswith("At the last change, at 12.88 s, mark ")
    cause = "At the last change, at 12.88 s, the camera does not see all marks."
    assert (why["head"], why["text"]) == ("Why", cause)
    assert advice["actions"] == [{"label": "Undo the last change", "undo": True}]
    bench.undo()
    assert not bench.ended and not bench.edited
    what = explained(bench)["findings"][1]["text"]
    assert (
        what
        == "At the last change the run converged: every error is below the tolerance of 0.01 px."
    )


def test_the_search_for_changes_is_announced_for_a_failure_only():
    for name, count in (("local_minimum", 1), ("visp_tutorial", 0)):
        bench = Workbench(load_scenario(examples.path(name)))
        explained(bench, trials=False)
        first = {"texts": bench.texts, "why": bench.why}
        texts = [each["text"] for each in add_search_note(first)["why"]["findings"]]
        assert texts.count("Searching for changes that help …") == count
        assert texts[: len(texts) - count] == [each["text"] for each in bench.why["findings"]]


def test_a_saved_card_has_the_changes_since_the_original():
    bench = Workbench(load_scenario(examples.path("visp_tutorial")))
    assert not bench.why["changed"]
    bench.set("task.gain", 2.0)
    assert explained(bench)["changed"]
    assert bench.recording().header["why"]["changes"] == bench.differences != []
    bench.restore_original()
    assert not bench.why["changed"]


def test_a_growing_error_has_its_norm_and_the_period_its_length():
    run = load_scenario(examples.path("chapter_6_1")).at("task.gain", 60).run()
    causes = explain(run).causes
    first, last = run.error_norm.values[[0, 1]]
    assert causes[0].sentence.startswith("The gain is too high for the period of 40 ms: gain times")
    assert causes[1].sentence == (
        f"The error did not shrink: its norm grew from {first:.3g} px to {last:.3g} px."
    )


PULLS = {  # pull of the target in metres, and the start of the reason why the camera stays away
    "unicycle_docking, sideways": ((0.0, 0.05, 0.0), "the wheels do not roll along 49.1 mm"),
    "unicycle_docking, up": ((0.0, 0.0, 0.03), "the commanded velocities do not produce 30 mm"),
    "holonomic, up": ((0.0, 0.0, 0.03), "the commanded velocities do not produce 30 mm"),
    "differential_drive, sideways": ((0.0, 0.05, 0.0), "the features do not change along 149 mm"),
    "car, ahead": ((0.05, 0.0, 0.0), "the features do not change along 441 mm"),
}


@pytest.mark.parametrize("which", PULLS)
def test_a_pull_after_which_the_camera_stays_away_has_its_reason_at_once_and_at_the_end(which):
    name, (shift, reason) = which.partition(",")[0], PULLS[which]
    bench = Workbench(load_scenario(examples.path(name)))
    while not bench.idle:
        bench.step()
    handle = next(each for each in bench.handles if each.name.startswith("objects."))
    position = [x + dx for x, dx in zip(handle.pose, shift, strict=False)]
    bench.drag(handle.name, [*position, *handle.pose[3:]])
    assert bench.return_remark.startswith(reason)
    why = explained(bench, trials=False)
    words = reason.partition(" along")[0].partition(" produce")[0]
    texts = [each["text"].lower() for each in why["findings"] if each["head"]]
    assert why["missed"] and any(words in each for each in texts)


@pytest.mark.parametrize("shift", [(0.05, 0.0, 0.0), (0.0, 0.05, 0.0)])
def test_a_pull_that_the_robot_follows_has_no_remark(shift):
    bench = Workbench(load_scenario(examples.path("holonomic")))
    while not bench.idle:
        bench.step()
    pose = next(each.pose for each in bench.handles if each.name == "objects.board")
    bench.drag("objects.board", [*(np.add(pose[:3], shift).tolist()), *pose[3:]])
    assert bench.return_remark == ""


def test_before_its_end_a_run_has_the_remark_alone():
    why = Workbench(load_scenario(examples.path("camera_retreat"))).why
    assert (why["headline"], why["findings"]) == ("", [])
    assert labels(why["watch"]) == ["Try L mean", "beside it"]


@pytest.mark.parametrize("name", examples.names())
def test_each_command_of_a_remark_is_a_button_that_the_experiment_accepts(name):
    experiment = load_scenario(examples.path(name))
    remark = list_remark_entries(extract_remark(examples.path(name).read_text(encoding="utf-8")))
    watch = list_watch_entries(experiment)
    assert json.loads(json.dumps(watch)) == watch and len(watch) == len(remark)
    for entry, said in zip(watch, remark, strict=True):
        text, *rest = entry["text"].split("\n")
        assert text == said.sentence
        assert all(line in said.commands and line.startswith(NO_BUTTON[name]) for line in rest)
        changes = [action["change"] for action in entry["actions"] if "change" in action]
        runs = [
            line for line in said.commands if line.startswith("robsim run") and line not in rest
        ]
        assert len(changes) == len(runs)
        for change, command in zip(changes, runs, strict=True):
            options = [f"{path}={value}" for path, value in change.items()]
            assert experiment.at(change) == load_scenario(examples.path(name), options)
            assert all(path in command for path in change)


def test_the_remarks_have_as_many_buttons_as_commands():
    count = sum(
        len(each.commands)
        for name in examples.names()
        for each in list_remark_entries(
            extract_remark(examples.path(name).read_text(encoding="utf-8"))
        )
    )
    assert count == COMMANDS


def test_a_comparison_offers_its_schemes_beside_the_run():
    watch = list_watch_entries(load_scenario(examples.path("schemes_compared")))
    *_, last = watch
    assert [each["label"] for each in last["actions"]] == [
        *("PBVS beside it", "hybrid beside it", "partitioned beside it")
    ]


def test_a_second_scheme_differs_in_one_value_that_a_control_shows():
    experiment = load_scenario(examples.path("joint_lag"))
    assert find_second_scheme(experiment, {"actuation.lag": "125 ms"}) == {"actuation.lag": 0.125}
    assert find_second_scheme(experiment, {"run.dt": "20 ms"}) == {}
    assert find_second_scheme(experiment, {"task.gain": 2, "task.interaction": "mean"}) == {}
    assert find_second_scheme(experiment, {"task.gain": experiment.task.gain}) == {}
    mission = load_scenario(examples.path("inspection_a"))
    assert labels(list_watch_entries(mission)) == ["Try rear of roll: 5 m"]


@pytest.mark.parametrize("change", [{"task.gian": "2"}, {"task.gain": "-1"}, {"task": "[["}])
def test_a_change_that_the_experiment_refuses_is_no_button(change):
    assert build_change_actions(load_scenario(examples.path("visp_tutorial")), change) == []


def test_a_page_of_a_run_has_the_why_without_buttons():
    experiment = load_scenario(examples.path("local_minimum"))
    why = build_recording(experiment.run(), experiment).header["why"]
    assert why["headline"].startswith("missed the goal by 55 cm and 32 deg")
    assert labels(why["findings"]) == labels(why["watch"]) == []
    assert why["watch"][1]["text"].endswith(
        "robsim run local_minimum.toml --set task.interaction=mean"
    )


def test_a_page_of_a_mission_has_its_ending():
    bench = Workbench(load_scenario(examples.path("inspection_a")))
    assert bench.why["headline"] == "14 phases done after 37.6 s" and not bench.why["missed"]
    assert bench.why["watch"][1]["actions"][0]["change"] == {"task.phases.roll.task.to.rear": "5 m"}
