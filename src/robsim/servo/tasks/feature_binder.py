"""Binding of feature blocks to the true and the believed scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare.problems import prefix_path
from robsim.features.feature import Feature, reads_pictures
from robsim.servo.bound_block import BoundBlock
from robsim.servo.bound_features import BoundFeatures, GoalViews
from robsim.servo.camera_target import CameraTarget, PairKey, make_camera_target
from robsim.servo.feature_block import FeatureBlock
from robsim.servo.goals.goal import (
    GoalFeatures,
    find_goal_configuration,
    find_goal_pairs,
    observe_goal,
)
from robsim.servo.goals.goal_pictures import add_goal_pictures, observe_goal_pictures
from robsim.servo.laws.broyden_rule import Broyden, Interaction
from robsim.servo.tasks.task_checks import is_collinear
from robsim.world.scene import Scene

BlockTargets = list[tuple[CameraTarget, ...]]  # for each block, the pairs of its one or two cameras


def find_camera_targets(task: Any, scene: Scene) -> BlockTargets:
    """Return the camera-target pairs of each block of a task.

    A block's own camera and target take precedence over the task's. Raises InputError
    for an unknown name, and for a camera that no joint moves relative to the target.
    """
    by_key: dict[PairKey, CameraTarget] = {}
    each = []
    for part in task.blocks:
        names = part.camera or task.camera
        several = names if isinstance(names, tuple) else (names,)
        sights = [make_camera_target(scene, name, part.target or task.target) for name in several]
        each.append(tuple(by_key.setdefault(s.key, s) for s in sights))
    return each


def bind_features(task: Any, truth: BlockTargets, columns: NDArray[np.int64]) -> BoundFeatures:
    """Return the bound features of a task, from its true camera-target pairs.

    Raises InputError or GoalError if the goal, the belief or the depth does not fit the scene.
    """
    scene, goal, depths, belief = truth[0][0].scene, task.goal, task.depths, task.belief
    exact = belief is None or belief == scene
    with prefix_path("belief"):
        believed = truth if exact else _find_believed_targets(belief, scene, truth)
    truths, sights = deduplicate_targets(truth), deduplicate_targets(believed)
    runs = max(depths.runs, *(each.runs for each in (*truths, *sights)))
    q_shown = find_goal_configuration(goal, scene, runs)
    shown, goal_sights = find_goal_pairs(goal, truths, truths if exact else sights)
    pictured, marked = _sort_pairs(task.blocks, believed)
    goals = {
        t.key: observe_goal(goal, q_shown, t, b, goal_sights[0], runs, t.key in marked)
        for t, b in zip(shown, goal_sights, strict=True)
    }
    for true, own in zip(shown, goal_sights, strict=True):
        if true.key in pictured:
            pictures = observe_goal_pictures(goal, q_shown, true, own, goals[true.key])
            goals[true.key] = add_goal_pictures(goals[true.key], own, pictures)
    for each in sights:
        depths.check(len(each.target.marks), each.target.name)
    if pictured:
        _check_pictured_task(task, bool(marked))
    with prefix_path("features"):
        bound = tuple(_bind_block(*pair) for pair in zip(task.blocks, believed, strict=True))
    which: Interaction | Array = (
        "current" if isinstance(task.interaction, Broyden) else task.interaction
    )
    s_goal = np.asarray(goal.s) if isinstance(goal, GoalFeatures) else None
    views = GoalViews(q_shown, shown[0], goal_sights, goals, goal)
    draft = BoundFeatures(bound, sights, exact, columns, depths, which, views, s_goal, runs)
    return draft.measure_from_goal()


def _sort_pairs(
    blocks: Sequence[FeatureBlock], believed: BlockTargets
) -> tuple[set[PairKey], set[PairKey]]:
    """Return the pairs with features of pictures, and the pairs with features of marks."""
    pictured, marked = set[PairKey](), set[PairKey]()
    for part, sights in zip(blocks, believed, strict=True):
        kind = pictured if reads_pictures(part.feature) else marked
        kind.update(sight.key for sight in sights)
    return pictured, marked


def _check_pictured_task(task: Any, has_marks: bool) -> None:
    """Raise InputError for fields of a task with features of pictures that need marks."""
    if task.depths.filtered:
        raise InputError("depth: a filter follows marks; features of pictures have none")
    if task.weighting:
        raise InputError(
            "weighting: it weighs marks; features of pictures have none (see `robust` of Luminance)"
        )
    if task.detector is not None and not has_marks:
        raise InputError("detector: it detects marks; features of pictures have none")
    dense = (part.feature for part in task.blocks if hasattr(part.feature, "with_interaction"))
    if isinstance(task.interaction, Broyden) and (feature := next(dense, None)) is not None:
        raise InputError(
            f"interaction: {type(feature).__name__} takes 'current', 'desired' or 'mean', and no "
            "estimate on line"
        )


def deduplicate_targets(blocks: BlockTargets) -> tuple[CameraTarget, ...]:
    """Return every camera-target pair once, in order."""
    return tuple({sight.key: sight for sights in blocks for sight in sights}.values())


def _bind_block(part: FeatureBlock, sights: tuple[CameraTarget, ...]) -> BoundBlock:
    """Return a block bound to its camera-target pairs; raise InputError if it does not fit."""
    feature, target = cast(Feature, part.feature), sights[0].target
    _check_picture_block(part)
    marks, components = (_convert_indices(part.marks), _convert_indices(part.components))
    if marks is not None and marks.max() >= len(target.marks):
        raise InputError(
            f"'{target.name}' has {len(target.marks)} marks, numbered from 0; "
            f"there is no {marks.max()}"
        )
    _check_camera_count(feature, sights)
    _check_feature_marks(feature, target.marks if marks is None else target.marks[marks])
    return BoundBlock(feature, sights, marks, components, part.weight)


def _check_picture_block(part: FeatureBlock) -> None:
    """Raise InputError if a block selects marks of a picture, or numbers that belong together."""
    name = type(part.feature).__name__
    if reads_pictures(part.feature) and part.marks is not None:
        raise InputError(f"marks: {name} uses the whole picture, and has no marks")
    if part.components is not None and hasattr(part.feature, "with_interaction"):
        raise InputError(f"components: the numbers of {name} act together only")


def _check_camera_count(feature: Feature, sights: Sequence[CameraTarget]) -> None:
    """Raise InputError unless a feature gets the one or two cameras that it needs."""
    needed = getattr(feature, "cameras", 1)
    if needed not in (1, 2):
        raise InputError(
            f"{type(feature).__name__}.cameras must be 1 or 2, got {format_value(needed)}"
        )
    if needed != len(sights):
        names = "', '".join(sight.eye.name for sight in sights)
        expected = "two cameras, as in camera=('left', 'right')" if needed == 2 else "one camera"
        raise InputError(f"{type(feature).__name__} needs {expected}, got '{names}'")


def _check_feature_marks(feature: Feature, marks: Array) -> None:
    """Raise InputError if a feature gets too few marks, or a pose marks on one line."""
    name, poses = type(feature).__name__, getattr(feature, "uses_pose", False)
    least = max(getattr(feature, "least_marks", 1), 3 if poses else 1)
    if len(marks) < least:
        raise InputError(f"{name} needs at least {least} marks, got {len(marks)}")
    if poses and is_collinear(marks):
        raise InputError(f"{name} needs marks that are not on one line, which determines no pose")


def _convert_indices(numbers: tuple[int, ...] | None) -> NDArray[np.int64] | None:
    """Return indices as an array, or None."""
    return None if numbers is None else np.array(numbers, dtype=np.int64)


def _find_believed_targets(belief: Any, scene: Scene, truth: BlockTargets) -> BlockTargets:
    """Return the camera-target pairs in the believed scene.

    The belief may differ from the scene in numbers, but not in its parts; otherwise raises
    InputError.
    """
    if not isinstance(belief, Scene):
        raise InputError(f"expected a Scene (see Scene.replacing), got {format_value(belief)}")
    believed_joints, joints = _list_coordinates(belief), _list_coordinates(scene)
    if believed_joints != joints:
        raise InputError(f"the belief has the joints {believed_joints}, the scene {joints}")
    _check_believed_pictures(belief, scene)
    by_key: dict[PairKey, CameraTarget] = {}
    for true in deduplicate_targets(truth):
        target = true.target.name
        by_key[true.key] = true.in_scene(belief)
        marks = len(by_key[true.key].target.marks), len(true.target.marks)
        if marks[0] != marks[1]:
            raise InputError(f"the belief has {marks[0]} marks on '{target}', the scene {marks[1]}")
    return [tuple(by_key[sight.key] for sight in sights) for sights in truth]


def _check_believed_pictures(belief: Scene, scene: Scene) -> None:
    """Raise InputError if the belief has a light, a background or optics of its own."""
    plain = Scene()
    for name in ("light", "background"):
        if getattr(belief, name) not in (getattr(scene, name), getattr(plain, name)):
            raise InputError(
                f"{name}: a controller does not use it; change the {name} of the true scene"
            )
    true_optics = {eye.name: eye.optics for eye in scene.cameras}
    for eye in belief.cameras:
        if eye.optics is not None and eye.optics != true_optics.get(eye.name):
            raise InputError(
                f"optics of camera '{eye.name}': a controller does not use them; change the optics "
                "of the true scene"
            )


def _list_coordinates(scene: Scene) -> list[str]:
    """Return the coordinates with their units, which distinguish joints of one name."""
    pairs = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    return [f"{name} ({unit})" for name, unit in pairs]
