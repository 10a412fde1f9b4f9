"""Explanations of runs of joints with drives: each cause is found, and only if it is the cause."""

from dataclasses import replace
from functools import cache

import driven_arms
import numpy as np
import pytest

import robsim as rs
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.stability_limit import find_loop_limit

PROPORTIONAL = rs.drives.VelocityLoop(integral_rate=0.0)
BLIND = rs.drives.VelocityLoop(integral_rate=0.0, gravity=False)
LIGHT = rs.drives.VelocityLoop(integral_rate=0.0, model=rs.drives.DriveModel(mass=0.7))
MOON = rs.drives.VelocityLoop(integral_rate=0.0, model=rs.drives.DriveModel(gravity=0.2))
FAST = rs.drives.IndustrialServo(1200.0, 100.0, 100.0, 0.002)
LOAD = [rs.drives.Payload("arm.tip", 2.0)]
FAILURES = {
    "saturation": driven_arms.servo(rs.drives.VelocityLoop(), effort=(10.0, 20.0)),
    "friction": driven_arms.servo(PROPORTIONAL, friction=(6.0, 3.0)),
    "gravity": driven_arms.servo(BLIND),
    "drive.model.mass": driven_arms.servo(LIGHT),
    "drive.model.gravity": driven_arms.servo(MOON),
    "payload": driven_arms.servo(PROPORTIONAL, payloads=LOAD),
    "unstable drive": driven_arms.servo(FAST),
    "gain": driven_arms.servo(rs.drives.IndustrialServo(), gain=120.0, friction=(0.2, 0.1)),
}


@cache
def explain_failure(about):
    return explain(FAILURES[about])


def explain(experiment, **options):
    return rs.explain(experiment.run(), experiment, **options)


@pytest.mark.parametrize("about", FAILURES)
def test_the_cause_is_found_by_its_removal(about):
    explanation = explain_failure(about)
    assert explanation.outcome is not rs.Outcome.CONVERGED
    assert [cause.about for cause in explanation.causes] == [about]
    assert explanation.causes[0].evidence["converges_after_s"] < 4.0


def test_the_changes_of_a_cause_make_the_run_converge():
    experiment = FAILURES["payload"]
    changes = explain_failure("payload").causes[0].changes
    assert dict(changes) == {"actuation.drive.model.payload": True}
    assert experiment.at(changes).run().outcome == rs.Outcome.CONVERGED


def test_numbers_of_saturation_and_friction():
    run = FAILURES["saturation"].run()
    cause = explain_failure("saturation").causes[0]
    last = round(float(run.end_time) / 0.01) + 1
    assert cause.evidence["saturated"] == pytest.approx(run.saturation.values[1:last].mean(0).max())
    assert "'upper' at 10 N m for 99.5 %" in cause.sentence
    held = explain_failure("friction").causes[0]
    assert held.evidence["friction"] == 6.0
    assert held.evidence["at_rest"] == 1.0
    assert "rested against its command for 100 % of the run" in held.sentence


def test_an_unstable_drive_has_a_sentence_and_a_remedy():
    explanation = explain_failure("unstable drive")
    assert explanation.outcome is rs.Outcome.UNSTABLE
    assert "the joints are unstable" in explanation.what
    assert "IndustrialServo is unstable by itself" in explanation.causes[0].sentence
    assert explanation.advice[0].about == "bandwidth"
    assert "a quarter of the bandwidth" in explanation.advice[0].sentence


def test_the_largest_gain_is_the_limit_of_advise():
    cause = explain_failure("gain").causes[0]
    largest = 120.0 * find_loop_limit(LinearLoop.of(FAILURES["gain"]))
    assert cause.evidence["largest_gain"] == pytest.approx(largest, rel=1e-6)


def test_what_does_no_harm_is_no_cause():
    drive = rs.drives.VelocityLoop(gravity=False, model=rs.drives.DriveModel(mass=0.7))
    harmless = driven_arms.servo(drive, payloads=LOAD, friction=(0.01, 0.0), gain=3.0)
    explanation = explain(harmless)
    assert explanation.outcome is rs.Outcome.CONVERGED
    assert explanation.causes == ()
    blind = explain(replace_friction(FAILURES["gravity"], 1e-6))
    assert [cause.about for cause in blind.causes] == ["gravity"]
    assert any("friction" in remark for remark in blind.remarks)


def replace_friction(experiment, friction):
    scene = experiment.scene
    robot = scene.robots[0]
    links = [
        replace(each, joint=replace(each.joint, friction=friction if each.joint.moves else 0.0))
        for each in robot.links
    ]
    return experiment.with_(scene=scene.replacing(replace(robot, links=tuple(links))))


def test_a_slow_drift_by_the_weight_is_no_unstable_drive():
    raised = driven_arms.servo(BLIND).with_(start=np.array([1.5, 0.1]))
    abouts = [cause.about for cause in explain(raised, trials=False).causes]
    assert "unstable drive" not in abouts
    assert "gain" not in abouts


def test_saturation_of_a_run_that_converges_is_a_note():
    tight = driven_arms.servo(
        rs.drives.VelocityLoop(), gain=20.0, effort=(27.0, 20.0), offset=(-0.5, 0.6)
    )
    explanation = explain(tight)
    assert explanation.outcome is rs.Outcome.CONVERGED
    assert [cause.about for cause in explanation.causes] == ["saturation"]
    free = explain(driven_arms.servo(rs.drives.VelocityLoop()))
    assert free.causes == ()


def test_friction_is_named_though_the_run_without_it_has_no_time_to_converge():
    slow = {"task.tolerance": 1e-6, "task.gain": 1.0}
    experiment = rs.load_scenario(rs.examples.path("joint_friction")).at(slow)
    found = rs.explain(experiment.run(), experiment)
    (cause,) = (each for each in found.causes if each.about == "friction")
    assert "Friction holds 'shoulder'" in cause.sentence and "at rest" in cause.sentence
    assert cause.evidence["error_without"] < 0.01  # pixels, of 39
