"""Advice as changes by path: the experiment that the sentence promises, run again."""

from dataclasses import replace

import pytest

import robsim as rs
from robsim import examples
from robsim.analysis.explanation.path_changes import find_path_changes

pytestmark = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
ADVICE = {  # number of pieces of advice of each shipped experiment that fails
    "camera_law_stalls": 3,
    "desired_through_the_target": 3,
    "local_minimum": 3,
    "marks_that_lie": 1,
    "noise_floor": 1,
    "pbvs_loses_target": 3,
    "tilted_square": 3,
    "uneven_depth": 1,
}


@pytest.mark.parametrize("name", ADVICE)
def test_each_piece_of_advice_is_a_change_that_keeps_its_promise(name):
    experiment = rs.load_scenario(examples.path(name))
    run = experiment.run()
    assert rs.Outcome(int(run.outcome)) is not rs.Outcome.CONVERGED
    explanation = rs.explain(run)
    assert len(explanation.advice) == ADVICE[name] and all(a.changes for a in explanation.advice)
    for finding in (*explanation.causes, *explanation.advice):
        if finding.changes:
            tried = experiment.at(finding.changes).run()
            promised = finding.evidence.get("converges_after_s")
            if promised is None:  # outliers: the mean distance is smaller, and the time is up
                assert float(tried.end_time) == experiment.duration
            else:
                assert rs.Outcome(int(tried.outcome)) is rs.Outcome.CONVERGED
                assert float(tried.end_time) == promised


def test_advice_is_written_as_a_person_writes_it():
    explanation = rs.explain(rs.load_scenario(examples.path("local_minimum")).run())
    assert [each.changes for each in explanation.advice] == [
        {"task.interaction": "mean"},
        {"task.interaction": "desired"},
        {"task.kind": "pbvs"},
    ]


def test_a_converged_run_that_missed_names_the_belief_that_reaches_the_goal():
    experiment = rs.load_scenario(examples.path("calibration_errors"))
    run = experiment.run()
    (cause,) = [each for each in rs.explain(run).causes if each.changes]
    cured = experiment.at(cause.changes).run()
    assert float(run.distance_to_goal) > 0.09 and float(cured.distance_to_goal) < 2e-5


def test_more_time_is_a_longer_duration():
    experiment = rs.load_scenario(examples.path("visp_tutorial"), ["run.duration=15 s"])
    advice = {each.about: each for each in rs.explain(experiment.run()).advice}
    assert advice["duration"].changes == {"run.duration": "45.0 s"}
    end = experiment.at(advice["duration"].changes).run().end_time
    assert float(end) == advice["duration"].evidence["converges_after_s"] == pytest.approx(20.4)


def test_a_change_in_python_has_no_path():
    class Mine(rs.laws.JointLaw):
        pass

    experiment = rs.load_scenario(examples.path("visp_tutorial"))
    mine = experiment.with_(task=replace(experiment.task, law=Mine()))
    assert find_path_changes(experiment, mine) == find_path_changes(experiment, experiment) == {}
    assert find_path_changes(mine, mine.with_(dt=0.02)) == {}
