"""What a controller believes wrongly, piece by piece, and the belief with that piece put right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.case import Case
from robsim.analysis.explanation.removal import Change, Removal
from robsim.analysis.explanation.wording import degrees, length, number
from robsim.analysis.leaves import changed, leaves
from robsim.pose import Pose
from robsim.robot import Robot
from robsim.scene import Mounted, Object, Scene

Part = Robot | Object | Mounted


def false_beliefs(case: Case) -> list[Removal]:
    """Every piece of a belief of the task that differs from the scene, each once."""
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


def _camera(believed: Mounted, true: Mounted) -> Iterator[Removal]:
    mine, real = believed.camera, true.camera
    if not np.array_equal(mine.K, real.K) or mine.distortion != real.distortion:
        sentence = (
            f"The intrinsics of '{true.name}' are believed wrongly: focal length "
            f"{number(mine.K[0, 0])} px and centre ({number(mine.K[0, 2])}, "
            f"{number(mine.K[1, 2])}) px, in truth {number(real.K[0, 0])} px and "
            f"({number(real.K[0, 2])}, {number(real.K[1, 2])}) px."
        )
        evidence = {"focal_ratio": float(mine.K[0, 0] / real.K[0, 0])}
        name = f"the intrinsics of '{true.name}'"
        yield _false("intrinsics", name, sentence, _right(true, "camera"), evidence)
    yield from _placed(believed, true, "hand-eye", "hand-eye pose")


def _robot(believed: Robot, true: Robot) -> Iterator[Removal]:
    joints = [[(k.name, k.parent, k.joint) for k in robot.links] for robot in (believed, true)]
    if joints[0] != joints[1]:
        sentence = f"The links of '{true.name}' are believed wrongly."
        name = f"the links of '{true.name}'"
        yield _false("robot model", name, sentence, _right(true, "links"))
    yield from _placed(believed, true, "base", "base", "base")


def _object(believed: Object, true: Object) -> Iterator[Removal]:
    if not np.array_equal(believed.marks, true.marks):
        off = float(np.linalg.norm(believed.marks - true.marks, axis=1).max())
        sentence = f"The marks on '{true.name}' are believed up to {length(off)} off."
        name = f"the marks of '{true.name}'"
        yield _false("target model", name, sentence, _right(true, "marks"), {"off_m": off})
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
    sentence = (
        f"The {noun} of '{true.name}' is believed {degrees(angle)} and {length(metres)} "
        "away from where it is"
        + (": beyond 90 degrees every command leads away." if angle > np.pi / 2 else ".")
    )
    evidence = {"angle_deg": float(np.degrees(angle)), "off_m": metres}
    name = f"the {noun} of '{true.name}'"
    yield _false(about, name, sentence, _right(true, field, "on"), evidence)


def _false(
    about: str, name: str, sentence: str, change: Change, evidence: dict[str, float] | None = None
) -> Removal:
    return Removal(about, name, sentence, change, evidence or {}, f"with {name} put right")


def _right(true: Part, *fields: str) -> Change:
    """The change that gives these fields of the believed part their true values."""
    values = {name: getattr(true, name) for name in fields}

    def part_of(belief: Scene) -> Any:
        find = {Mounted: belief.camera, Robot: belief.robot, Object: belief.object}
        return find[type(true)](true.name)

    def change(case: Case) -> Case:
        def right(leaf: Any) -> Any:
            if leaf.belief is None:
                return leaf
            part = replace(part_of(leaf.belief), **values)
            return replace(leaf, belief=leaf.belief.replacing(part))

        return case.but(task=changed(case.task, right))

    return change
