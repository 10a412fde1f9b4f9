"""An experiment without advice gives one clear error."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs


def example(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes)


def with_task(**changes):
    experiment = example("visp_tutorial")
    return experiment.with_(task=replace(experiment.task, **changes))


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (lambda: 3, "experiment: expected an Experiment, got 3"),
        (lambda: example("inspection_a"), "advise: a mission has a loop for each phase"),
        (lambda: example("unicycle_docking"), "advise: the command has no derivative at the goal"),
        (lambda: example("car"), "advise: a car at rest cannot turn"),
        (lambda: example("pan_tilt_tracking"), "advise: robot 'carousel' moves on its own"),
        (
            lambda: example("visp_tutorial").vary({"task.gain": [1.0, 2.0]}),
            r"advise: expected one run, got several: give experiment\.of_run",
        ),
        (
            lambda: example("visp_tutorial").with_(
                start=np.tile(example("visp_tutorial").start, (2, 1))
            ),
            "advise: expected one run, got several",
        ),
        (
            lambda: example("visp_tutorial").with_(sensing=rs.Sensing(latency=1e6)),
            r"advise: interval and latency of the images: expected at most 1000 .* got 2.5e\+07",
        ),
        (
            lambda: example("visp_tutorial").with_(sensing=rs.Sensing(dropped=0.95)),
            "advise: at most 0.9 of the images may be lost, got 0.95",
        ),
        (lambda: with_task(interaction=rs.laws.Broyden()), r"advise: .*interaction=Broyden\(...\)"),
        (lambda: with_task(depth=rs.laws.DepthFilter(0.5)), r"advise: .*depth=DepthFilter\(...\)"),
        (
            lambda: example("joint_lag").with_(task=rs.FollowJoints([0.0] * 6, duration=2.0)),
            "advise: FollowJoints follows a trajectory and uses no image",
        ),
    ],
    ids=lambda each: each if isinstance(each, str) else "made",
)
def test_an_experiment_without_a_linear_loop_has_no_advice(made, says):
    with pytest.raises(rs.errors.InputError, match=says):
        rs.advise(made())


def test_a_goal_that_the_joints_cannot_reach():
    """Three joints that turn the camera are to bring it nearer."""
    arm = example("joint_lag")
    task = rs.PBVS(goal=rs.GoalPose(rs.Pose.at(0, 0, 5.0)))
    with pytest.raises(rs.errors.InputError, match="does not come to rest"):
        rs.advise(arm.with_(task=task, actuation=rs.Actuation()))
