"""Changes of a case that remove obstacles or change the control scheme."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robsim.analysis.field import borderless
from robsim.analysis.leaves import changed, leaves
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.tasks.task import ServoTask


def without_border(case: Experiment) -> Experiment:
    """Return the case with cameras whose images have no border."""
    return case.with_(scene=borderless(case.scene))


def larger_image(case: Experiment) -> Experiment:
    """Return the case with images twice as wide and high, at the same focal length."""
    eyes = []
    for eye in case.scene.cameras:
        camera = eye.camera
        if camera.size is not None:
            K, (width, height) = camera.K.copy(), camera.size
            K[:2, 2] += width / 2, height / 2
            camera = replace(camera, K=K, size=(2 * width, 2 * height))
        eyes.append(replace(eye, camera=camera))
    return case.with_(scene=case.scene.replacing(*eyes))


def without_limits(case: Experiment) -> Experiment:
    """Return the case without joint limits."""
    free = [_unlimited(robot) for robot in case.scene.robots]
    return case.with_(scene=case.scene.replacing(*free))


def _unlimited(robot: Robot) -> Robot:
    links = [replace(link, joint=replace(link.joint, limits=None)) for link in robot.links]
    return replace(robot, links=tuple(links))


def with_gain(case: Experiment, factor: float) -> Experiment | None:
    """Return the case with its gain times a factor; None if it has no gain to change."""

    def change(leaf: ServoTask) -> ServoTask:
        gain = leaf.gain
        if isinstance(gain, AdaptiveGain):
            numbers = ("at_zero", "at_infinity", "slope")
            new: Any = replace(gain, **{name: factor * getattr(gain, name) for name in numbers})
        else:
            new = factor * gain
        return replace(leaf, **{"gain": new})

    return _leaves(case, change)


def with_leaves(case: Experiment, **values: Any) -> Experiment | None:
    """Return the case with other fields in every servo task; None if one lacks them."""
    return _leaves(case, lambda leaf: replace(leaf, **values))


def weighed_robustly(case: Experiment) -> Experiment | None:
    """Return the case with robust weights in every servo task, beside those that it has."""
    return _leaves(case, lambda leaf: replace(leaf, weighting=(*leaf.weighting, "tukey")))


def _leaves(case: Experiment, change: Any) -> Experiment | None:
    if not leaves(case.task):
        return None
    try:
        return case.with_(task=changed(case.task, change))
    except (TypeError, ValueError):  # this kind of task does not let the field be chosen
        return None
