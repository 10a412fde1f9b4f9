"""Small mistakes in what a controller believes: a unit of each number, one at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from robsim.analysis.leaves import changed, leaves, with_fields
from robsim.geometry.pose import Pose
from robsim.robot.robot import Robot
from robsim.servo.sight import Sight
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.belief import ROW
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

SHARE, PIXEL, METRE, ANGLE, BEND = 0.01, 1.0, 1e-3, math.radians(1.0), 0.02
UNITS = {SHARE: "1 %", PIXEL: "1 px", METRE: "1 mm", ANGLE: "1 deg", BEND: "0.02"}
TURNING = "revolute", "prismatic"  # joints whose constants a calibration finds

Wrong = tuple[str, float, dict[str, Any]]  # name, unit, and what `Scene.believe` takes


@dataclass(frozen=True)
class Mistake:
    """A number that is believed wrongly by a unit: what `Scene.believe` takes; nothing: depths."""

    name: str
    unit: str
    wrong: Mapping[str, Any] = field(default_factory=dict)

    def made(self, task: Task, scene: Scene) -> Task:
        """Return the task with this mistake beside those that it has."""
        return changed(task, lambda leaf: self._made(leaf, scene))

    def _made(self, leaf: ServoTask, scene: Scene) -> ServoTask:
        if not self.wrong:
            larger = _larger(leaf.depth_scale) if leaf.needs_depth else leaf.depth_scale
            return with_fields(leaf, depth_scale=larger)
        belief = scene if leaf.belief is None else leaf.belief
        return replace(leaf, belief=belief.believe(**self.wrong))


def _larger(scale: Any) -> Any:
    larger = np.multiply(scale, 1.0 + SHARE)
    return tuple(larger.tolist()) if larger.ndim else float(larger)


def mistakes(task: Task, scene: Scene, sights: Sequence[Sight]) -> Iterator[Mistake]:
    """Yield the mistakes in the depths, and in what the sights depend on."""
    if any(leaf.needs_depth for leaf in leaves(task)):
        yield Mistake("task.depth_scale", UNITS[SHARE])
    kinds: tuple[tuple[str, str, Any, Callable[[Any], Iterator[Wrong]]], ...] = (
        ("cameras", "camera", [sight.eye for sight in sights], _of_camera),
        ("objects", "target", [sight.target for sight in sights], _of_target),
        ("robots", "robot", scene.robots, _of_robot),
    )
    for kind, who, parts, each in kinds:
        for name, part in {part.name: part for part in parts}.items():
            for number, unit, wrong in each(part):
                yield Mistake(f"{kind}.{name}.{number}", UNITS[unit], {who: name, **wrong})


def _of_camera(eye: MountedCamera) -> Iterator[Wrong]:
    """Yield mistakes in the intrinsics of a camera, and in where it is mounted."""
    first, *others = eye.camera.distortion or (0.0, 0.0, 0.0, 0.0)
    yield "focal", SHARE, {"focal": 1.0 + SHARE}
    yield "center.x", PIXEL, {"center": (PIXEL, 0.0)}
    yield "center.y", PIXEL, {"center": (0.0, PIXEL)}
    yield "distortion.k1", BEND, {"distortion": (first + BEND, *others)}
    yield from _poses("hand_eye")


def _of_target(thing: Object) -> Iterator[Wrong]:
    """Yield mistakes in the model of a target, and in where it stands."""
    yield "size", SHARE, {"size": 1.0 + SHARE}
    yield from _poses("place")


def _of_robot(robot: Robot) -> Iterator[Wrong]:
    """Yield mistakes in a Denavit-Hartenberg row after each joint, and in where a robot stands."""
    for link in robot.links:
        for name, unit in zip(ROW, (ANGLE, METRE, METRE, ANGLE), strict=True):
            if link.joint.model.name in TURNING:
                yield f"links.{link.name}.dh.{name}", unit, {"dh": {link.name: {name: unit}}}
    yield from _poses("base")


def _poses(what: str) -> Iterator[Wrong]:
    """Yield small mistakes in a pose, along and about each axis."""
    for axis, along in zip("xyz", np.eye(3), strict=True):
        yield f"position.{axis}", METRE, {what: Pose.at(*(METRE * along))}
    for axis, about in zip("xyz", np.eye(3), strict=True):
        yield f"rotation.{axis}", ANGLE, {what: Pose.at(rotvec=ANGLE * about)}
