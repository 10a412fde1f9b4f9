"""The schemes of the textbooks: features with a law, to be given a goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import Whole, Word, register
from robsim.features.pose import Translation
from robsim.servo.feature_block import FeatureBlock, Indices
from robsim.servo.laws.law import UnitOfLength
from robsim.servo.laws.partitioned import Advance, PartitionedLaw, Roll
from robsim.servo.regulated import Regulated
from robsim.servo.tasks.task import ServoTask


@register("task", "ibvs")
@dataclass(frozen=True, eq=False)
class IBVS(ServoTask):
    """Image-based visual servoing: regulate image features, edot = -gain e (chapter, eqs. 5 to 8).

    >>> IBVS(goal=[0, 0], interaction="mean").gain
    1.0
    """


@register("task", "pbvs")
@dataclass(frozen=True, eq=False)
class PBVS(ServoTask):
    """Position-based visual servoing: regulate the pose of the target, estimated from its marks.

    form "goal": s = (c*t_c, theta u), and the camera goes straight in the goal's axes; "camera":
    s = (ct_o, theta u), and the target's origin goes straight in the camera's (Chaumette and
    Hutchinson 2006, the section on position-based servoing). All else is as in `IBVS`.

    >>> [type(part.feature).__name__ for part in PBVS(form="camera").blocks]
    ['Translation', 'ThetaU']
    """

    features: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    form: Annotated[
        str,
        Word(("goal", "camera"), "form"),
        "Translation that is regulated: that of the camera in goal axes, or of the target in "
        "camera axes.",
    ] = "goal"

    def __post_init__(self) -> None:
        form: Any = self.form
        object.__setattr__(self, "features", [Translation(form), "theta_u"])
        super().__post_init__()


@register("task", "hybrid")
@dataclass(frozen=True, eq=False)
class Hybrid(ServoTask):
    """2 1/2 D visual servoing: s = (x, y, log Z/Z*, theta u) of one mark (Malis et al. 1999).

    The mark goes straight in the image, and L is triangular. All else is as in `IBVS`.

    >>> Hybrid(mark=2).blocks[0].marks
    (2,)
    """

    features: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    mark: Annotated[
        int, Whole(0, 9_999), "Number of the mark that moves along a straight line in the image."
    ] = 0

    def __post_init__(self) -> None:
        one = [FeatureBlock(name, marks=(self.mark,)) for name in ("points", "log_depth")]
        object.__setattr__(self, "features", [*one, FeatureBlock("theta_u")])
        super().__post_init__()


@register("task", "partitioned")
@dataclass(frozen=True, eq=False)
class Partitioned(ServoTask):
    """The partitioned scheme of Corke and Hutchinson 2001, which treats the optical axis apart.

    Roll follows the angle of the line through two marks (`segment`), the way along the axis the
    area of the polygon of all marks, and the other four components the points. All else is as in
    `IBVS`, but that it takes no feed-forward; the law is `PartitionedLaw(roll, advance, length)`.

    >>> Partitioned(roll=0.5).law
    PartitionedLaw(roll=0.5, advance=1.0, length=1.0)
    """

    own_law: ClassVar[bool] = True
    features: Any = field(default=None, init=False, repr=False)
    law: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    segment: Annotated[
        tuple[int, int],
        Indices(least=2, most=2),
        "Numbers of the two marks whose line gives the angle of roll.",
    ] = (0, 1)
    roll: Roll = 1.0
    advance: Advance = 1.0
    length: UnitOfLength = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        pair = FeatureBlock("segments", marks=self.segment, components=(3,))
        law = PartitionedLaw(self.roll, self.advance, self.length)
        area = FeatureBlock("region_moments", components=(0,))
        put(self, "features", [FeatureBlock("points"), pair, area])
        put(self, "law", law)
        super().__post_init__()

    def bound_law(self, regulated: Regulated) -> PartitionedLaw:
        """Return the law; InputError if no joint moves the camera along its optical axis."""
        if np.abs(regulated.at_goal.J[2]).max() < 1e-9:
            raise InputError(
                "the partitioned scheme moves the camera along its optical axis, and no commanded "
                f"joint moves '{regulated.sights[0].eye.name}' so"
            )
        law: PartitionedLaw = self.law
        return law
