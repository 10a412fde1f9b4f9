"""The differences between a controller's belief and the true scene, and beliefs without them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation.ablation import Ablation
from robsim.analysis.explanation.text_format import (
    format_length,
    format_list,
    format_number,
    format_offset,
)
from robsim.analysis.task_tree import list_servo_tasks, map_servo_tasks
from robsim.geometry.pose import Pose
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

BelievedPart = Robot | Object | MountedCamera


def find_false_beliefs(case: Experiment) -> list[Ablation]:
    """Return every part of a task's belief that differs from the scene, each once."""
    removals: dict[str, Ablation] = {}
    for leaf in list_servo_tasks(case.task):
        if leaf.belief is not None:
            for removal in _compare_scenes(leaf.belief, case.scene):
                removals.setdefault(removal.name, removal)
    return list(removals.values())


def _compare_scenes(belief: Scene, truth: Scene) -> Iterator[Ablation]:
    """Yield the differences of all cameras, robots and objects."""
    for eye in truth.cameras:
        yield from _compare_cameras(belief.camera(eye.name), eye)
    for robot in truth.robots:
        yield from _compare_robots(belief.robot(robot.name), robot)
    for thing in truth.objects:
        yield from _compare_objects(belief.object(thing.name), thing)


def _compare_cameras(believed: MountedCamera, true: MountedCamera) -> Iterator[Ablation]:
    """Yield the differences of a camera's intrinsics and mounting pose."""
    mine, real = believed.camera, true.camera
    lenses = [(camera.lens, camera.distortion) for camera in (mine, real)]
    if not np.array_equal(mine.K, real.K) or lenses[0] != lenses[1]:
        difference = _describe_intrinsics(mine, real)
        sentence = f"The believed intrinsics of '{true.name}' are wrong: {difference}."
        evidence = {"focal_ratio": float(mine.K[0, 0] / real.K[0, 0])}
        yield _make_belief_ablation(
            "intrinsics", "intrinsics", true, ("camera",), sentence, evidence
        )
    yield from _compare_poses(believed, true, "hand-eye", "hand-eye pose")


def _describe_intrinsics(mine: Camera, real: Camera) -> str:
    """Return a description of the wrong intrinsics."""
    intrinsics = [_format_intrinsics(camera) for camera in (mine, real)]
    return "; ".join(
        f"{noun} {believed}, true {intrinsics[1][noun]}"
        for noun, believed in intrinsics[0].items()
        if believed != intrinsics[1][noun]
    )


def _format_intrinsics(camera: Camera) -> dict[str, str]:
    """Return the intrinsics as texts by noun."""
    (fx, skew, x), (_, fy, y) = camera.K[:2].tolist()
    focal = format_number(fx) if fx == fy else f"{format_number(fx)} by {format_number(fy)}"
    bends = ", ".join(format_number(k) for k in camera.distortion)
    return {
        "focal length": f"{focal} px",
        "skew": f"{format_number(skew)} px",
        "centre": f"({format_number(x)}, {format_number(y)}) px",
        "lens": camera.lens,
        "distortion": f"({bends})" if bends else "none",
    }


def _compare_robots(believed: Robot, true: Robot) -> Iterator[Ablation]:
    """Yield the differences of a robot's links and base pose."""
    joints = [{k.name: (k.parent, k.joint) for k in robot.links} for robot in (believed, true)]
    if joints[0] != joints[1]:
        wrong = [f"'{name}'" for name, joint in joints[1].items() if joints[0].get(name) != joint]
        which = f": {format_list(wrong)}" if wrong else ""
        sentence = f"The believed links of '{true.name}' are wrong{which}."
        yield _make_belief_ablation("robot model", "links", true, ("links",), sentence)
    yield from _compare_poses(believed, true, "base", "base", "base")


def _compare_objects(believed: Object, true: Object) -> Iterator[Ablation]:
    """Yield the differences of an object's marks and pose."""
    if not np.array_equal(believed.marks, true.marks):
        distance = float(np.linalg.norm(believed.marks - true.marks, axis=1).max())
        sentence = f"The believed marks on '{true.name}' are up to {format_length(distance)} off."
        yield _make_belief_ablation(
            "target model", "marks", true, ("marks",), sentence, {"off_m": distance}
        )
    yield from _compare_poses(believed, true, "target pose", "pose")


def _compare_poses(
    believed: Any, true: Any, about: str, noun: str, field: str = "pose"
) -> Iterator[Ablation]:
    """Yield the difference between a believed and a true pose."""
    mine: Pose = getattr(believed, field)
    real: Pose = getattr(true, field)
    if mine == real and believed.on == true.on:
        return
    difference = real.inv() @ mine
    metres, angle = (
        float(np.linalg.norm(difference.position)),
        float(np.linalg.norm(difference.rotvec)),
    )
    warning = (
        ": beyond 90 degrees commands can lead away from the goal" if angle > np.pi / 2 else ""
    )
    sentence = (
        f"The believed {noun} of '{true.name}' is off by {format_offset(metres, angle)}{warning}."
    )
    evidence = {"angle_deg": float(np.degrees(angle)), "off_m": metres}
    yield _make_belief_ablation(about, noun, true, (field, "on"), sentence, evidence)


def _make_belief_ablation(
    about: str,
    noun: str,
    true: BelievedPart,
    fields: tuple[str, ...],
    sentence: str,
    evidence: dict[str, float] | None = None,
) -> Ablation:
    """Return the removal of a false belief, which sets the named fields to their true values."""
    name, values = f"the {noun} of '{true.name}'", {each: getattr(true, each) for each in fields}

    def correct(leaf: Any) -> Any:
        if leaf.belief is None:
            return leaf
        known = *leaf.belief.robots, *leaf.belief.objects, *leaf.belief.cameras
        wrong = next(part for part in known if part.name == true.name)
        return replace(leaf, belief=leaf.belief.replacing(replace(wrong, **values)))

    def change(case: Experiment) -> Experiment:
        return case.with_(task=map_servo_tasks(case.task, correct))

    return Ablation(about, name, sentence, change, evidence or {}, f"with {name} corrected")
