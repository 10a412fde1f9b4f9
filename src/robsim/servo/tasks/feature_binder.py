"""Binding of feature blocks to a scene, as it is and as it is believed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, format_value
from robsim.declare.problems import prefix_path
from robsim.servo.bound_block import BoundBlock
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget, PairKey, make_camera_target
from robsim.servo.feature_block import FeatureBlock
from robsim.servo.goals.goal import GoalFeatures, find_goal_configuration, observe_goal
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.tasks.task_checks import is_collinear
from robsim.world.scene import Scene

BlockTargets = list[tuple[CameraTarget, ...]]  # of each part, the sights of its one or two cameras


def find_camera_targets(task: Any, scene: Scene) -> BlockTargets:
    """Return the sights of each block of a task, whose own camera and target come first.

    InputError: a name that does not exist, or a camera that nothing moves.
    """
    made: dict[PairKey, CameraTarget] = {}
    each = []
    for part in task.blocks:
        names = part.camera or task.camera
        several = names if isinstance(names, tuple) else (names,)
        found = [make_camera_target(scene, name, part.target or task.target) for name in several]
        each.append(tuple(made.setdefault(s.key, s) for s in found))
    return each


def bind_features(task: Any, truth: BlockTargets, columns: NDArray[np.int64]) -> BoundFeatures:
    """Return what a task regulates with its true sights.

    InputError, GoalError: it cannot, or not with its goal, belief or depth.
    """
    scene, goal, depths, belief = truth[0][0].scene, task.goal, task.depths, task.belief
    exact = belief is None or belief == scene
    with prefix_path("belief"):
        believed = truth if exact else _find_believed_targets(belief, scene, truth)
    truths, sights = deduplicate_targets(truth), deduplicate_targets(believed)
    both = zip(truths, sights, strict=True)
    runs = max(depths.runs, *(each.runs for each in (*truths, *sights)))
    q_goal = find_goal_configuration(goal, scene, runs)
    goals = {t.key: observe_goal(goal, q_goal, t, b, sights[0], runs) for t, b in both}
    for each in sights:
        depths.check(len(each.target.marks), each.target.name)
    with prefix_path("features"):
        bound = tuple(_bind_block(*pair) for pair in zip(task.blocks, believed, strict=True))
    which: Any = "current" if isinstance(task.interaction, Broyden) else task.interaction
    given = goal.s if isinstance(goal, GoalFeatures) else None
    draft = BoundFeatures(bound, sights, exact, columns, depths, which, goals, q_goal, given, runs)
    return draft.at_its_goal()


def deduplicate_targets(found: BlockTargets) -> tuple[CameraTarget, ...]:
    """Return every sight once, in order."""
    return tuple({sight.key: sight for sights in found for sight in sights}.values())


def _bind_block(part: FeatureBlock, sights: tuple[CameraTarget, ...]) -> BoundBlock:
    """Return a block bound to its sights; InputError if it cannot be measured there."""
    feature, target = part.feature, sights[0].target
    chosen, components = (_convert_indices(part.marks), _convert_indices(part.components))
    if chosen is not None and chosen.max() >= len(target.marks):
        raise InputError(
            f"'{target.name}' has {len(target.marks)} marks, numbered from 0; "
            f"there is no {chosen.max()}"
        )
    _check_camera_count(feature, sights)
    _check_feature_marks(feature, target.marks if chosen is None else target.marks[chosen])
    return BoundBlock(feature, sights, chosen, components, part.weight)


def _check_camera_count(feature: Any, sights: Sequence[CameraTarget]) -> None:
    needed = getattr(feature, "cameras", 1)
    if needed not in (1, 2):
        raise InputError(
            f"{type(feature).__name__}.cameras must be 1 or 2, got {format_value(needed)}"
        )
    if needed != len(sights):
        given = "', '".join(sight.eye.name for sight in sights)
        wanted = "two cameras, as in camera=('left', 'right')" if needed == 2 else "one camera"
        raise InputError(f"{type(feature).__name__} needs {wanted}, and is given '{given}'")


def _check_feature_marks(feature: Any, marks: Any) -> None:
    name, poses = type(feature).__name__, getattr(feature, "uses_pose", False)
    least = max(getattr(feature, "least_marks", 1), 3 if poses else 1)
    if len(marks) < least:
        raise InputError(f"{name} needs at least {least} marks, and sees {len(marks)}")
    if poses and is_collinear(marks):
        raise InputError(
            f"{name} needs marks that are not on one line: a pose follows from no line"
        )


def _convert_indices(numbers: tuple[int, ...] | None) -> NDArray[np.int64] | None:
    return None if numbers is None else np.array(numbers, dtype=np.int64)


def _find_believed_targets(belief: Any, scene: Scene, truth: BlockTargets) -> BlockTargets:
    """Return the same sights in the belief, which may differ in numbers, but not in its parts."""
    if not isinstance(belief, Scene):
        raise InputError(f"expected a Scene (see Scene.replacing), got {format_value(belief)}")
    there, here = _list_coordinates(belief), _list_coordinates(scene)
    if there != here:
        raise InputError(f"the belief has the joints {there}, the scene {here}")
    made: dict[PairKey, CameraTarget] = {}
    for true in deduplicate_targets(truth):
        camera, target = true.key
        made[true.key] = CameraTarget(belief, belief.camera(camera), belief.object(target))
        marks = len(made[true.key].target.marks), len(true.target.marks)
        if marks[0] != marks[1]:
            raise InputError(f"the belief has {marks[0]} marks on '{target}', the scene {marks[1]}")
    return [tuple(made[sight.key] for sight in sights) for sights in truth]


def _list_coordinates(scene: Scene) -> list[str]:
    """Return the coordinates with their units, which tell joints of one name apart."""
    both = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    return [f"{name} ({unit})" for name, unit in both]
