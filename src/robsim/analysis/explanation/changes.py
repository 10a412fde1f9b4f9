"""Changes of a case that take away what stands in its way, or that are another way to servo."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from robsim.analysis.case import Case
from robsim.analysis.leaves import changed, leaves
from robsim.robot.robot import Robot
from robsim.servo import AdaptiveGain, ServoTask


def without_border(case: Case) -> Case:
    """Cameras whose images have no border."""
    eyes = [replace(eye, camera=replace(eye.camera, size=None)) for eye in case.scene.cameras]
    return case.but(scene=case.scene.replacing(*eyes))


def larger_image(case: Case) -> Case:
    """Images twice as wide and high about their centres, of cameras with the same focal length."""
    eyes = []
    for eye in case.scene.cameras:
        camera = eye.camera
        if camera.size is not None:
            K, (width, height) = camera.K.copy(), camera.size
            K[:2, 2] += width / 2, height / 2
            camera = replace(camera, K=K, size=(2 * width, 2 * height))
        eyes.append(replace(eye, camera=camera))
    return case.but(scene=case.scene.replacing(*eyes))


def without_limits(case: Case) -> Case:
    """Joints that turn and slide as far as they like."""
    free = [_unlimited(robot) for robot in case.scene.robots]
    return case.but(scene=case.scene.replacing(*free))


def _unlimited(robot: Robot) -> Robot:
    links = [replace(link, joint=replace(link.joint, limits=None)) for link in robot.links]
    return replace(robot, links=tuple(links))


def with_gain(case: Case, factor: float) -> Case | None:
    """So many times the gain; None if the task has no gain to change."""

    def change(leaf: ServoTask) -> ServoTask:
        gain = leaf.gain
        if isinstance(gain, AdaptiveGain):
            numbers = ("at_zero", "at_infinity", "slope")
            new: Any = replace(gain, **{name: factor * getattr(gain, name) for name in numbers})
        else:
            new = factor * gain
        return replace(leaf, gain=new)

    return _leaves(case, change)


def with_leaves(case: Case, **values: Any) -> Case | None:
    """Other fields of every servo task; None if one of them does not have these."""
    return _leaves(case, lambda leaf: replace(leaf, **values))


def _leaves(case: Case, change: Any) -> Case | None:
    if not leaves(case.task):
        return None
    try:
        return case.but(task=changed(case.task, change))
    except (TypeError, ValueError):  # a field that this kind of task decides itself
        return None
