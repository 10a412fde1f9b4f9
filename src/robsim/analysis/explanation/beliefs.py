"""The differences between a controller's belief and the true scene, and their corrections."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.wording import away, length, listed, number
from robsim.analysis.leaves import changed, leaves
from robsim.geometry.pose import Pose
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

FeatureBlock = Robot | Object | MountedCamera


def false_beliefs(case: Experiment) -> list[Removal]:
    """Return every part of a task's belief that differs from the scene, each once."""
    found: dict[str, Removal] = {}
    for leaf in leaves(case.task):
        if leaf.belief is not None:
            for removal in _pieces(leaf.belief, case.scene):
                found.setdefault(removal.name, removal)
    return list(found.values())


def _pieces(belief: Scene, truth: Scene) -> Iterator[Removal]:
    for eye in truth.cameras:
        yield from _camera(belief.camera(eye.name), eye)
    for robot in truth.robots:
        yield from _robot(belief.robot(robot.name), robot)
    for thing in truth.objects:
        yield from _object(belief.object(thing.name), thing)


def _camera(believed: MountedCamera, true: MountedCamera) -> Iterator[Removal]:
    mine, real = believed.camera, true.camera
    if not np.array_equal(mine.K, real.K) or mine.distortion != real.distortion:
        sentence = f"The intrinsics of '{true.name}' are believed wrongly: {_lens(mine, real)}."
        evidence = {"focal_ratio": float(mine.K[0, 0] / real.K[0, 0])}
        yield _false("intrinsics", "intrinsics", true, ("camera",), sentence, evidence)
    yield from _placed(believed, true, "hand-eye", "hand-eye pose")


def _lens(mine: Camera, real: Camera) -> str:
    """Return a description of the intrinsics that are wrong."""
    intrinsics = [_intrinsics(camera) for camera in (mine, real)]
    return "; ".join(
        f"{noun} {believed}, in truth {intrinsics[1][noun]}"
        for noun, believed in intrinsics[0].items()
        if believed != intrinsics[1][noun]
    )


def _intrinsics(camera: Camera) -> dict[str, str]:
    (fx, skew, x), (_, fy, y) = camera.K[:2].tolist()
    focal = number(fx) if fx == fy else f"{number(fx)} by {number(fy)}"
    bends = ", ".join(number(k) for k in camera.distortion)
    return {
        "focal length": f"{focal} px",
        "skew": f"{number(skew)} px",
        "centre": f"({number(x)}, {number(y)}) px",
        "distortion": f"({bends})" if bends else "none",
    }


def _robot(believed: Robot, true: Robot) -> Iterator[Removal]:
    joints = [{k.name: (k.parent, k.joint) for k in robot.links} for robot in (believed, true)]
    if joints[0] != joints[1]:
        wrong = [f"'{name}'" for name, joint in joints[1].items() if joints[0].get(name) != joint]
        which = f": {listed(wrong)}" if wrong else ""
        sentence = f"Links of '{true.name}' are believed wrongly{which}."
        yield _false("robot model", "links", true, ("links",), sentence)
    yield from _placed(believed, true, "base", "base", "base")


def _object(believed: Object, true: Object) -> Iterator[Removal]:
    if not np.array_equal(believed.marks, true.marks):
        off = float(np.linalg.norm(believed.marks - true.marks, axis=1).max())
        sentence = f"The marks on '{true.name}' are believed up to {length(off)} off."
        yield _false("target model", "marks", true, ("marks",), sentence, {"off_m": off})
    yield from _placed(believed, true, "target pose", "pose")


def _placed(
    believed: Any, true: Any, about: str, noun: str, field: str = "pose"
) -> Iterator[Removal]:
    mine: Pose = getattr(believed, field)
    real: Pose = getattr(true, field)
    if mine == real and believed.on == true.on:
        return
    apart = real.inv() @ mine
    metres, angle = float(np.linalg.norm(apart.position)), float(np.linalg.norm(apart.rotvec))
    leads = ": beyond 90 degrees commands can lead away from the goal" if angle > np.pi / 2 else ""
    sentence = (
        f"The {noun} of '{true.name}' is believed {away(metres, angle)} away from where it is"
        f"{leads}."
    )
    evidence = {"angle_deg": float(np.degrees(angle)), "off_m": metres}
    yield _false(about, noun, true, (field, "on"), sentence, evidence)


def _false(
    about: str,
    noun: str,
    true: FeatureBlock,
    fields: tuple[str, ...],
    sentence: str,
    evidence: dict[str, float] | None = None,
) -> Removal:
    """Return the false belief in what some fields of a part say, put right by their true values."""
    name, values = f"the {noun} of '{true.name}'", {each: getattr(true, each) for each in fields}

    def right(leaf: Any) -> Any:
        if leaf.belief is None:
            return leaf
        known = *leaf.belief.robots, *leaf.belief.objects, *leaf.belief.cameras
        wrong = next(part for part in known if part.name == true.name)
        return replace(leaf, belief=leaf.belief.replacing(replace(wrong, **values)))

    def change(case: Experiment) -> Experiment:
        return case.with_(task=changed(case.task, right))

    return Removal(about, name, sentence, change, evidence or {}, f"with {name} put right")
