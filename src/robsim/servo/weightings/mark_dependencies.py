"""Dependence of each component of s on the marks, for weightings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.declare.problems import prefix_path
from robsim.servo.bound_block import BoundBlock
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.weightings.weighting_protocol import ComponentGroup, MarkWeighting, Weighting

POSE_MARKS = 4  # fewer marks leave several poses


@dataclass(frozen=True, eq=False)
class MarkDependencies:
    """Marks that determine the components of one feature block."""

    part: BoundBlock
    marks: NDArray[np.bool_]  # (k, cameras, N)

    @property
    def uses_pose(self) -> bool:
        """Whether the feature depends on a pose, which is estimated from the measured marks."""
        return bool(getattr(self.part.feature, "uses_pose", False))

    def of_number(self, i: int) -> list[tuple[PairKey, int]]:
        """Return the marks that determine a component: camera-target pair and index of each."""
        return [(self.part.sights[c].key, int(n)) for c, n in np.argwhere(self.marks[i])]

    @property
    def least_marks(self) -> int:
        """Number of marks that a pose needs."""
        return min(POSE_MARKS, int(self.marks[0].sum()))


def find_mark_dependencies(regulated: BoundFeatures) -> list[MarkDependencies]:
    """Return the marks that determine the components of each block at the goal.

    Raises InputError if a feature depends on all marks at once, so that no mark may be missing.
    """
    result = [MarkDependencies(part, marks) for part, marks in regulated.find_dependencies()]
    for each in result:
        counts = each.marks.any(axis=1)
        whole = counts.any(axis=0).sum()
        if not each.uses_pose and whole > 2 and (counts.sum(axis=1) == whole).all():
            raise InputError(
                f"{each.part.name} depends on all marks at once, so that none may be missing: "
                "weigh points, lines or segments, or a pose"
            )
    return result


def group_components(each: list[MarkDependencies]) -> tuple[ComponentGroup, ...]:
    """Return the components of s grouped by the marks that determine them."""
    result: list[ComponentGroup] = []
    first = 0
    for part, one in enumerate(each):
        sets: dict[bytes, list[int]] = {}
        for i, marks in enumerate(one.marks):
            sets.setdefault(marks.tobytes(), []).append(first + i)
        result += [ComponentGroup(part, tuple(numbers)) for numbers in sets.values()]
        first += len(one.marks)
    return tuple(result)


def check_weighting(
    weighting: Sequence[Weighting | MarkWeighting], regulated: BoundFeatures
) -> None:
    """Raise InputError for weightings that do not fit the features."""
    if not weighting:
        return
    with prefix_path("weighting"):
        find_mark_dependencies(regulated)
        for each in weighting:
            for sight in regulated.sights:
                _check_weighting_target(each, sight)
                if getattr(each, "by_goal", False):
                    _check_goal_image(each, sight, regulated)


def _check_weighting_target(weighting: Weighting | MarkWeighting, sight: CameraTarget) -> None:
    """Raise InputError if the target has too few marks, or the image no known size."""
    least, marks = getattr(weighting, "least_marks", 1), len(sight.target.marks)
    if marks < least:
        raise InputError(
            f"{type(weighting).__name__} needs {least} marks or more, and "
            f"'{sight.target.name}' has {marks}"
        )
    if getattr(weighting, "excuses", False) and sight.eye.camera.size is None:
        raise InputError(f"camera '{sight.eye.name}' has no image size, and therefore no border")


def _check_goal_image(
    weighting: Weighting | MarkWeighting, sight: CameraTarget, regulated: BoundFeatures
) -> None:
    """Raise InputError unless the goal determines the image of every mark."""
    unknown = np.isnan(regulated.locate_marks(sight)).any(axis=(1, 2))
    if unknown.any():
        raise InputError(
            f"{type(weighting).__name__} needs the image of the marks at the goal, and the numbers "
            f"of this goal do not give it for mark {np.flatnonzero(unknown)[0]} of "
            f"'{sight.target.name}': use a q, a GoalPose, or features 'points' or 'pixels' of "
            "every mark"
        )
