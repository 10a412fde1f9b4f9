"""The schemes of the textbooks: features with a law, to be given a goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import Annotated, Any

import numpy as np

from robsim.base.errors import InputError
from robsim.base.value import construct_unchecked
from robsim.declare import Integer, Word, register
from robsim.features.pose_error import Translation
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_block import FeatureBlock, IndexList
from robsim.servo.laws.broyden_rule import INTERACTION
from robsim.servo.laws.inverse import INVERSE
from robsim.servo.laws.law import UnitOfLength
from robsim.servo.laws.partitioned_law import AdvanceGain, PartitionedLaw, RollGain
from robsim.servo.shaping.command_fields import RedundancyFields
from robsim.servo.tasks.task_fields import (
    DepthFields,
    FeatureFields,
    LawFields,
    TaskGain,
    WeightingFields,
)

MODEL_INTERACTION = replace(INTERACTION, only=(), beside_of={})
TRUNCATION_ONLY = replace(
    INVERSE, only=("pseudo_inverse",), beside_of={"rcond": ("pseudo_inverse", "rcond")}
)


@register("task", "ibvs")
@dataclass(frozen=True, eq=False)
class IBVS(RedundancyFields, WeightingFields, LawFields, DepthFields, FeatureFields):
    """Image-based visual servoing: regulate image features, edot = -gain e (chapter, eqs. 5 to 8).

    >>> IBVS(goal=[0, 0], interaction="mean").gain
    1.0
    """


@register("task", "pbvs")
@dataclass(frozen=True, eq=False)
class PBVS(RedundancyFields, WeightingFields, LawFields):
    """Position-based visual servoing: regulate the pose of the target, estimated from its marks.

    form "goal": s = (c*t_c, theta u), and the camera goes straight in the goal's axes; "camera":
    s = (ct_o, theta u), and the target's origin goes straight in the camera's (Chaumette and
    Hutchinson 2006, the section on position-based servoing).

    >>> [type(part.feature).__name__ for part in PBVS(form="camera").blocks]
    ['Translation', 'ThetaU']
    """

    _: KW_ONLY
    form: Annotated[
        str,
        Word(("goal", "camera"), "form"),
        "Translation that is regulated: that of the camera in goal axes, or of the target in "
        "camera axes.",
    ] = "goal"

    @property
    def features(self) -> Any:
        """The translation and the rotation of the target."""
        form: Any = self.form
        return [Translation(form), "theta_u"]


@register("task", "hybrid")
@dataclass(frozen=True, eq=False)
class Hybrid(RedundancyFields, WeightingFields, LawFields, DepthFields):
    """2 1/2 D visual servoing: s = (x, y, log Z/Z*, theta u) of one mark (Malis et al. 1999).

    The mark goes straight in the image, and L is triangular.

    >>> Hybrid(mark=2).blocks[0].marks
    (2,)
    """

    _: KW_ONLY
    mark: Annotated[
        int, Integer(0, 9_999), "Number of the mark that moves along a straight line in the image."
    ] = 0

    @property
    def features(self) -> Any:
        """The point and the logarithmic depth of the mark, and the rotation of the target."""
        one = [FeatureBlock(name, marks=(self.mark,)) for name in ("points", "log_depth")]
        return [*one, FeatureBlock("theta_u")]


@register("task", "partitioned")
@dataclass(frozen=True, eq=False)
class Partitioned(RedundancyFields, DepthFields):
    """The partitioned scheme of Corke and Hutchinson 2001, which treats the optical axis apart.

    Roll follows the angle of the line through two marks (`segment`), the way along the axis the
    area of the polygon of all marks, and the other four components the points. The law is
    `PartitionedLaw(roll, advance, length)`.

    >>> Partitioned(roll=0.5).law
    PartitionedLaw(roll=0.5, advance=1.0, length=1.0)
    """

    _: KW_ONLY
    interaction: Annotated[
        Any,
        MODEL_INTERACTION,
        "Interaction matrix L: now, at the goal, the mean of both, or a constant.",
    ] = "current"
    gain: TaskGain = 1.0
    inverse: Annotated[Any, TRUNCATION_ONLY, "Inverse of L."] = "pseudo_inverse"
    segment: Annotated[
        tuple[int, int],
        IndexList(least=2, most=2),
        "Numbers of the two marks whose line gives the angle of roll.",
    ] = (0, 1)
    roll: RollGain = 1.0
    advance: AdvanceGain = 1.0
    length: UnitOfLength = 1.0

    @property
    def features(self) -> Any:
        """The points, the angle of the segment and the area of the region of all marks."""
        angle = FeatureBlock("segments", marks=self.segment, components=(3,))
        area = FeatureBlock("region_moments", components=(0,))
        return [FeatureBlock("points"), angle, area]

    @property
    def law(self) -> PartitionedLaw:
        """The partitioned law with these gains."""
        return construct_unchecked(
            PartitionedLaw, roll=self.roll, advance=self.advance, length=self.length
        )

    def bound_law(self, regulated: BoundFeatures) -> PartitionedLaw:
        """Return the law; InputError if no joint moves the camera along its optical axis."""
        if np.abs(regulated.at_goal.J[2]).max() < 1e-9:
            raise InputError(
                "the partitioned scheme moves the camera along its optical axis, and no commanded "
                f"joint moves '{regulated.sights[0].eye.name}' so"
            )
        return self.law
