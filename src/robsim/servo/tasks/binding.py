"""Binding of feature blocks to a scene, as it is and as it is believed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, said
from robsim.declare.problems import under
from robsim.servo.bound_block import BoundBlock
from robsim.servo.feature_block import FeatureBlock
from robsim.servo.goals.goal import GoalFeatures, configuration, goal_observation
from robsim.servo.laws.broyden import Broyden
from robsim.servo.regulated import Regulated
from robsim.servo.sight import Key, Sight, sight
from robsim.servo.tasks.soundness import collinear
from robsim.world.scene import Scene

Found = list[tuple[Sight, ...]]  # of each part, the sights of its one or two cameras


def sights_of(task: Any, scene: Scene) -> Found:
    """Return the sights of each block of a task, whose own camera and target come first.

    InputError: a name that does not exist, or a camera that nothing moves.
    """
    made: dict[Key, Sight] = {}
    each = []
    for part in task.blocks:
        names = part.camera or task.camera
        several = names if isinstance(names, tuple) else (names,)
        found = [sight(scene, name, part.target or task.target) for name in several]
        each.append(tuple(made.setdefault(s.key, s) for s in found))
    return each


def regulated_by(task: Any, truth: Found, columns: NDArray[np.int64]) -> Regulated:
    """Return what a task regulates with its true sights.

    InputError, GoalError: it cannot, or not with its goal, belief or depth.
    """
    scene, goal, depths, belief = truth[0][0].scene, task.goal, task.depths, task.belief
    exact = belief is None or belief == scene
    with under("belief"):
        believed = truth if exact else _believed(belief, scene, truth)
    truths, sights = each_once(truth), each_once(believed)
    both = zip(truths, sights, strict=True)
    runs = max(depths.runs, *(each.runs for each in (*truths, *sights)))
    q_goal = configuration(goal, scene, runs)
    goals = {t.key: goal_observation(goal, q_goal, t, b, sights[0], runs) for t, b in both}
    for each in sights:
        depths.check(len(each.target.marks), each.target.name)
    with under("features"):
        bound = tuple(_bound(*pair) for pair in zip(task.blocks, believed, strict=True))
    which: Any = "current" if isinstance(task.interaction, Broyden) else task.interaction
    given = goal.s if isinstance(goal, GoalFeatures) else None
    draft = Regulated(bound, sights, exact, columns, depths, which, goals, q_goal, given, runs)
    return draft.at_its_goal()


def each_once(found: Found) -> tuple[Sight, ...]:
    """Return every sight once, in order."""
    return tuple({sight.key: sight for sights in found for sight in sights}.values())


def _bound(part: FeatureBlock, sights: tuple[Sight, ...]) -> BoundBlock:
    """Return a block bound to its sights; InputError if it cannot be measured there."""
    feature, target = part.feature, sights[0].target
    chosen, components = (_integers(part.marks), _integers(part.components))
    if chosen is not None and chosen.max() >= len(target.marks):
        raise InputError(
            f"'{target.name}' has {len(target.marks)} marks, numbered from 0; "
            f"there is no {chosen.max()}"
        )
    _check_cameras(feature, sights)
    _check_marks(feature, target.marks if chosen is None else target.marks[chosen])
    return BoundBlock(feature, sights, chosen, components, part.weight)


def _check_cameras(feature: Any, sights: Sequence[Sight]) -> None:
    needed = getattr(feature, "cameras", 1)
    if needed not in (1, 2):
        raise InputError(f"{type(feature).__name__}.cameras must be 1 or 2, got {said(needed)}")
    if needed != len(sights):
        given = "', '".join(sight.eye.name for sight in sights)
        wanted = "two cameras, as in camera=('left', 'right')" if needed == 2 else "one camera"
        raise InputError(f"{type(feature).__name__} needs {wanted}, and is given '{given}'")


def _check_marks(feature: Any, marks: Any) -> None:
    name, poses = type(feature).__name__, getattr(feature, "uses_pose", False)
    least = max(getattr(feature, "least_marks", 1), 3 if poses else 1)
    if len(marks) < least:
        raise InputError(f"{name} needs at least {least} marks, and sees {len(marks)}")
    if poses and collinear(marks):
        raise InputError(
            f"{name} needs marks that are not on one line: a pose follows from no line"
        )


def _integers(numbers: tuple[int, ...] | None) -> NDArray[np.int64] | None:
    return None if numbers is None else np.array(numbers, dtype=np.int64)


def _believed(belief: Any, scene: Scene, truth: Found) -> Found:
    """Return the same sights in the belief, which may differ in numbers, but not in its parts."""
    if not isinstance(belief, Scene):
        raise InputError(f"expected a Scene (see Scene.replacing), got {said(belief)}")
    there, here = _joints(belief), _joints(scene)
    if there != here:
        raise InputError(f"the belief has the joints {there}, the scene {here}")
    made: dict[Key, Sight] = {}
    for true in each_once(truth):
        camera, target = true.key
        made[true.key] = Sight(belief, belief.camera(camera), belief.object(target))
        marks = len(made[true.key].target.marks), len(true.target.marks)
        if marks[0] != marks[1]:
            raise InputError(f"the belief has {marks[0]} marks on '{target}', the scene {marks[1]}")
    return [tuple(made[sight.key] for sight in sights) for sights in truth]


def _joints(scene: Scene) -> list[str]:
    """Return the coordinates with their units, which tell joints of one name apart."""
    both = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    return [f"{name} ({unit})" for name, unit in both]
