"""Small mistakes in what a controller believes: a unit of each number, one at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from robsim.analysis.leaves import changed, counterpart, leaves, with_fields
from robsim.geometry.pose import Pose
from robsim.robot.robot import Robot
from robsim.servo.sight import Sight
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.belief import ROW, wrong_camera, wrong_robot, wrong_target
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

SHARE, PIXEL, METRE, ANGLE, BEND = 0.01, 1.0, 1e-3, math.radians(1.0), 0.02
UNITS = {SHARE: "1 %", PIXEL: "1 px", METRE: "1 mm", ANGLE: "1 deg", BEND: "0.02"}
TURNING = "revolute", "prismatic"  # joints whose constants a calibration finds

Part = Robot | Object | MountedCamera
Wrong = tuple[str, float, Callable[[Any], Part]]  # name, unit, and what makes a part wrong


@dataclass(frozen=True)
class Mistake:
    """A number that is believed wrongly by a unit, in a `part` of the belief; None: the depths."""

    name: str
    unit: str
    part: Part | None = None
    wrong: Callable[[Any], Part] | None = None

    def made(self, task: Task, scene: Scene) -> Task:
        """Return the task with this mistake beside those that it has."""
        return changed(task, lambda leaf: self._made(leaf, scene))

    def _made(self, leaf: ServoTask, scene: Scene) -> ServoTask:
        if self.part is None or self.wrong is None:
            larger = _larger(leaf.depth_scale) if leaf.needs_depth else leaf.depth_scale
            return with_fields(leaf, depth_scale=larger)
        belief = scene if leaf.belief is None else leaf.belief
        believed = counterpart(belief, self.part)
        return replace(leaf, belief=belief.replacing(self.wrong(believed)))


def _larger(scale: Any) -> Any:
    larger = np.multiply(scale, 1.0 + SHARE)
    return tuple(larger.tolist()) if larger.ndim else float(larger)


def mistakes(task: Task, scene: Scene, sights: Sequence[Sight]) -> Iterator[Mistake]:
    """Yield the mistakes in the depths, and in what the sights depend on."""
    if any(leaf.needs_depth for leaf in leaves(task)):
        yield Mistake("task.depth_scale", UNITS[SHARE])
    kinds: tuple[tuple[str, Any, Callable[[Any], Iterator[Wrong]]], ...] = (
        ("cameras", [sight.eye for sight in sights], _of_camera),
        ("objects", [sight.target for sight in sights], _of_target),
        ("robots", scene.robots, _of_robot),
    )
    for kind, parts, each in kinds:
        for name, part in {part.name: part for part in parts}.items():
            for number, unit, wrong in each(part):
                yield Mistake(f"{kind}.{name}.{number}", UNITS[unit], part, wrong)


def _of_camera(eye: MountedCamera) -> Iterator[Wrong]:
    """Yield mistakes in the intrinsics of a camera, and in where it is mounted."""
    right = {"focal": 1.0, "center": (0.0, 0.0), "distortion": None, "hand_eye": None}
    first, *others = eye.camera.distortion or (0.0, 0.0, 0.0, 0.0)
    wrong: list[tuple[str, float, dict[str, Any]]] = [
        ("focal", SHARE, {"focal": 1.0 + SHARE}),
        ("center.x", PIXEL, {"center": (PIXEL, 0.0)}),
        ("center.y", PIXEL, {"center": (0.0, PIXEL)}),
        ("distortion.k1", BEND, {"distortion": (first + BEND, *others)}),
        *((name, unit, {"hand_eye": pose}) for name, unit, pose in _poses()),
    ]
    for name, unit, given in wrong:
        yield name, unit, partial(wrong_camera, **{**right, **given})


def _of_target(thing: Object) -> Iterator[Wrong]:
    """Yield mistakes in the model of a target, and in where it stands."""
    yield "size", SHARE, partial(wrong_target, size=1.0 + SHARE, marks=None, place=None)
    for name, unit, pose in _poses():
        yield name, unit, partial(wrong_target, size=1.0, marks=None, place=pose)


def _of_robot(robot: Robot) -> Iterator[Wrong]:
    """Yield mistakes in a Denavit-Hartenberg row after each joint, and in where a robot stands."""
    for link in robot.links:
        for name, unit in zip(ROW, (ANGLE, METRE, METRE, ANGLE), strict=True):
            if link.joint.model.name in TURNING:
                row = {link.name: {name: unit}}
                wrong = partial(wrong_robot, dh=row, convention="standard", base=None)
                yield f"links.{link.name}.dh.{name}", unit, wrong
    for name, unit, pose in _poses():
        yield name, unit, partial(wrong_robot, dh=None, convention="standard", base=pose)


def _poses() -> Iterator[tuple[str, float, Pose]]:
    """Yield the name, unit and pose of a small mistake along and about each axis."""
    for axis, along in zip("xyz", np.eye(3), strict=True):
        yield f"position.{axis}", METRE, Pose.at(*(METRE * along))
    for axis, about in zip("xyz", np.eye(3), strict=True):
        yield f"rotation.{axis}", ANGLE, Pose.at(rotvec=ANGLE * about)
