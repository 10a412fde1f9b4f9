"""Changes of a case that remove obstacles or change the control scheme."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robsim.analysis.task_tree import TaskChange, list_servo_tasks, map_servo_tasks
from robsim.analysis.vector_fields import remove_image_borders
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.tasks.task import ServoTask


def remove_border(case: Experiment) -> Experiment:
    """Return the case with image borders removed."""
    return case.with_(scene=remove_image_borders(case.scene))


def enlarge_images(case: Experiment) -> Experiment:
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


def remove_joint_limits(case: Experiment) -> Experiment:
    """Return the case without joint limits."""
    robots = [_remove_robot_limits(robot) for robot in case.scene.robots]
    return case.with_(scene=case.scene.replacing(*robots))


def _remove_robot_limits(robot: Robot) -> Robot:
    """Return a robot without joint limits."""
    links = [replace(link, joint=replace(link.joint, limits=None)) for link in robot.links]
    return replace(robot, links=tuple(links))


def scale_gain(case: Experiment, factor: float) -> Experiment | None:
    """Return the case with its gain times a factor; None if the gain cannot be changed."""

    def change(leaf: ServoTask) -> ServoTask:
        gain = leaf.gain
        if isinstance(gain, AdaptiveGain):
            numbers = ("at_zero", "at_infinity", "slope")
            new: Any = replace(gain, **{name: factor * getattr(gain, name) for name in numbers})
        else:
            new = factor * gain
        return replace(leaf, **{"gain": new})

    return change_servo_tasks(case, change)


def replace_task_fields(case: Experiment, **values: Any) -> Experiment | None:
    """Return the case with other fields in every servo task; None if one lacks them."""
    return change_servo_tasks(case, lambda leaf: replace(leaf, **values))


def add_robust_weighting(case: Experiment) -> Experiment | None:
    """Return the case with robust weights in every servo task, in addition to its weightings."""

    def add(leaf: ServoTask) -> ServoTask:
        weighting: dict[str, Any] = {"weighting": (*leaf.weighting, "tukey")}
        return replace(leaf, **weighting)

    return change_servo_tasks(case, add)


def change_servo_tasks(case: Experiment, change: TaskChange) -> Experiment | None:
    """Return the case with `change` applied to every servo task; None if that is impossible."""
    if not list_servo_tasks(case.task):
        return None
    try:
        return case.with_(task=map_servo_tasks(case.task, change))
    except (TypeError, ValueError):  # this kind of task has no such field
        return None
