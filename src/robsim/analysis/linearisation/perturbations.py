"""Small errors in the beliefs of a controller: one unit of each number, one number at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robsim.analysis.task_tree import list_servo_tasks, map_servo_tasks, replace_fields
from robsim.geometry.pose import Pose
from robsim.robot.robot import Robot
from robsim.servo.camera_target import CameraTarget
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.belief_errors import DH_ERRORS
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

RELATIVE, PIXEL, METRE, ANGLE, DISTORTION = 0.01, 1.0, 1e-3, math.radians(1.0), 0.02
UNITS = {RELATIVE: "1 %", PIXEL: "1 px", METRE: "1 mm", ANGLE: "1 deg", DISTORTION: "0.02"}
CALIBRATED_JOINTS = "revolute", "prismatic"  # joints with constants that a calibration estimates

BeliefChange = tuple[str, float, dict[str, Any]]  # name, unit, arguments of `Scene.believe`


@dataclass(frozen=True)
class BeliefPerturbation:
    """An error of one unit in a believed number.

    `wrong` holds the arguments of `Scene.believe`; if it is empty, the depths of the task are
    wrong.
    """

    name: str
    unit: str
    wrong: Mapping[str, Any] = field(default_factory=dict)

    def apply(self, task: Task, scene: Scene) -> Task:
        """Return the task with this error added to the errors that it already has."""
        return map_servo_tasks(task, lambda leaf: self._apply_to_task(leaf, scene))

    def _apply_to_task(self, leaf: ServoTask, scene: Scene) -> ServoTask:
        if not self.wrong:
            larger = _enlarge_scale(leaf.depth_scale) if leaf.needs_depth else leaf.depth_scale
            return replace_fields(leaf, depth_scale=larger)
        belief = scene if leaf.belief is None else leaf.belief
        return replace(leaf, belief=belief.believe(**self.wrong))


def _enlarge_scale(scale: float | Sequence[float]) -> float | tuple[float, ...]:
    """Return a depth scale, one number or one for each mark, larger by one percent."""
    larger = np.asarray(np.multiply(scale, 1.0 + RELATIVE))
    return tuple(larger.tolist()) if larger.ndim else float(larger)


def generate_perturbations(
    task: Task, scene: Scene, sights: Sequence[CameraTarget]
) -> Iterator[BeliefPerturbation]:
    """Yield the errors of the depths, and of all numbers that determine the images."""
    if any(leaf.needs_depth for leaf in list_servo_tasks(task)):
        yield BeliefPerturbation("task.depth_scale", UNITS[RELATIVE])
    kinds: tuple[tuple[str, str, Any, Callable[[Any], Iterator[BeliefChange]]], ...] = (
        ("cameras", "camera", [sight.eye for sight in sights], _camera_perturbations),
        ("objects", "target", [sight.target for sight in sights], _target_perturbations),
        ("robots", "robot", scene.robots, _robot_perturbations),
    )
    for kind, keyword, parts, each in kinds:
        for name, part in {part.name: part for part in parts}.items():
            for number, unit, wrong in each(part):
                yield BeliefPerturbation(
                    f"{kind}.{name}.{number}", UNITS[unit], {keyword: name, **wrong}
                )


def _camera_perturbations(eye: MountedCamera) -> Iterator[BeliefChange]:
    """Yield errors of the intrinsics and of the mounting pose of a camera."""
    first, *others = eye.camera.distortion or (0.0, 0.0, 0.0, 0.0)
    yield "focal", RELATIVE, {"focal": 1.0 + RELATIVE}
    yield "center.x", PIXEL, {"center": (PIXEL, 0.0)}
    yield "center.y", PIXEL, {"center": (0.0, PIXEL)}
    yield "distortion.k1", DISTORTION, {"distortion": (first + DISTORTION, *others)}
    yield from _pose_perturbations("hand_eye")


def _target_perturbations(thing: Object) -> Iterator[BeliefChange]:
    """Yield errors of the size and of the pose of a target."""
    yield "size", RELATIVE, {"size": 1.0 + RELATIVE}
    yield from _pose_perturbations("place")


def _robot_perturbations(robot: Robot) -> Iterator[BeliefChange]:
    """Yield errors of the Denavit-Hartenberg row after each joint, and of the base pose."""
    for link in robot.links:
        for name, unit in zip(DH_ERRORS, (ANGLE, METRE, METRE, ANGLE), strict=True):
            if link.joint.model.name in CALIBRATED_JOINTS:
                yield f"links.{link.name}.dh.{name}", unit, {"dh": {link.name: {name: unit}}}
    yield from _pose_perturbations("base")


def _pose_perturbations(keyword: str) -> Iterator[BeliefChange]:
    """Yield small errors of a pose, along and about each axis."""
    for axis, along in zip("xyz", np.eye(3), strict=True):
        yield f"position.{axis}", METRE, {keyword: Pose.at(*(METRE * along))}
    for axis, about in zip("xyz", np.eye(3), strict=True):
        yield f"rotation.{axis}", ANGLE, {keyword: Pose.at(rotvec=ANGLE * about)}
