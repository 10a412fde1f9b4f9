"""A goal for samplers of starts in scenes and experiments without a visible goal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import GoalError, InputError
from robsim.geometry.pose import Pose
from robsim.run.experiment import Experiment
from robsim.servo.goals.goal import GoalPose
from robsim.servo.tasks.schemes import IBVS
from robsim.vision.camera import Camera, Visibility
from robsim.world.scene import Scene

STEPS = 40  # of the distance, each by half: up to ten million times the size of the target


def make_goal_visible(experiment: Any) -> Any:
    """Return an experiment with a goal that its camera sees, from an experiment or a scene.

    Other values are returned as they are. The goal of an experiment is replaced only if its camera
    does not see it.
    """
    if isinstance(experiment, Scene):
        return Experiment(experiment, IBVS(goal=_view_from_the_front(experiment)))
    if not isinstance(experiment, Experiment) or not hasattr(experiment.task, "goal"):
        return experiment
    try:
        experiment.loop()
    except GoalError:
        task = experiment.task
        names = (getattr(task, name, None) for name in ("camera", "target"))
        goal = _view_from_the_front(experiment.scene, *names)
        return experiment.with_(task=replace(task, goal=goal))
    return experiment


def _view_from_the_front(
    scene: Scene, camera: str | None = None, target: str | None = None
) -> GoalPose:
    """Return a goal with the target on the optical axis, far enough to see all its marks."""
    lens, marks = scene.camera(camera).camera, scene.object(target).marks
    middle = marks.mean(axis=0)
    size = float(np.sqrt(np.square(marks - middle).sum(axis=1).max()))
    for distance in (size * 1.5 ** np.arange(STEPS)).tolist():
        T_c_o = Pose.at(0, 0, 1.5 * distance) @ Pose.at(*-middle)
        if _sees_all(lens, T_c_o @ marks) and _sees_all(lens, marks - middle + [0, 0, distance]):
            return GoalPose(T_c_o)
    raise InputError("viewpoints: the camera sees the whole target from no distance")


def _sees_all(camera: Camera, X: Array) -> bool:
    """Return whether all points X (N, 3) in camera axes are in the image."""
    return bool((camera.image_of(move_runs_last(X[None], 2))[1] == Visibility.IN_IMAGE).all())
