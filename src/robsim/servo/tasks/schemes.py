"""The schemes of the textbooks: features and a law, ready to be given a goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Any, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.features import Translation
from robsim.servo.feature_block import FeatureBlock
from robsim.servo.laws.partitioned import PartitionedLaw
from robsim.servo.regulated import Regulated
from robsim.servo.tasks.task import ServoTask


@dataclass(frozen=True, eq=False)
class IBVS(ServoTask):
    """Regulate image features: edot = -gain e, as well as the robot can (chapter, eqs. 5 to 8).

    goal          q at which the goal is shown (None: home), `GoalPose(T_c_o)` or `GoalFeatures(s)`
    camera        name of the camera, or of the two of a stereo pair; None: the only one
    target        name of the object with the marks; None: the only one
    features      a name such as "points" or "pixels", a feature such as `Points()`, a list of
                  features and `FeatureBlock`s, which are stacked, or any object with measure
    interaction   L "current", "desired", "mean" of the two, a constant (k, 6), or `Broyden()`
    depth         Z in L: "true", "goal" (its value there), metres or `DepthFilter(start)`;
                  times depth_scale
    law           "joint", "camera", `CameraLaw(length)`, or any object with command
    gain          per second, or `AdaptiveGain(...)`
    inverse       "pseudo_inverse", "damped", "transpose", `PseudoInverse(rcond)` or
                  `DampedInverse(damping)`
    tolerance     converged when max|e| is below; None: the feature's own
    belief        a Scene with the same names, as the controller believes it; None: the truth
    feed_forward  for what moves on its own: "known", "estimated" or `EstimatedMotion(lag)`
    joints, secondary, projection, smooth_start, limit
                  what is commanded, and what is done to the command: see `Shaped`

    >>> IBVS(goal=[0, 0], interaction="mean").gain
    1.0
    """

    kind: ClassVar[str] = "ibvs"


@dataclass(frozen=True, eq=False)
class PBVS(ServoTask):
    """Regulate the pose of the target, estimated from its marks and its model.

    form "goal": s = (c*t_c, theta u), and the camera goes straight in the goal's axes; "camera":
    s = (ct_o, theta u), and the target's origin goes straight in the camera's (Chaumette and
    Hutchinson 2006, the section on position-based servoing). All else is as in `IBVS`.

    >>> [type(part.feature).__name__ for part in PBVS(form="camera").parts]
    ['Translation', 'ThetaU']
    """

    kind: ClassVar[str] = "pbvs"
    features: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    form: str = "goal"

    def __post_init__(self) -> None:
        form: Any = self.form
        object.__setattr__(self, "features", [Translation(form), "theta_u"])
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Hybrid(ServoTask):
    """2 1/2 D visual servoing: s = (x, y, log Z/Z*, theta u) of one mark (Malis et al. 1999).

    The mark goes straight in the image, and L is triangular. All else is as in `IBVS`.

    >>> Hybrid(mark=2).parts[0].marks
    (2,)
    """

    kind: ClassVar[str] = "hybrid"
    features: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    mark: int = 0

    def __post_init__(self) -> None:
        one = [FeatureBlock(name, marks=(self.mark,)) for name in ("points", "log_depth")]
        object.__setattr__(self, "features", [*one, FeatureBlock("theta_u")])
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Partitioned(ServoTask):
    """The partitioned scheme of Corke and Hutchinson 2001: the optical axis apart from the rest.

    Roll follows the angle of the line through two marks (`segment`), the way along the axis the
    area of the polygon of all marks, and the other four components the points. All else is as in
    `IBVS`, but that it takes no feed-forward; the law is `PartitionedLaw(roll, advance, length)`.

    >>> Partitioned(roll=0.5).law
    PartitionedLaw(roll=0.5, advance=1.0, length=1.0)
    """

    kind: ClassVar[str] = "partitioned"
    own_law: ClassVar[bool] = True
    features: Any = field(default=None, init=False, repr=False)
    law: Any = field(default=None, init=False, repr=False)
    _: KW_ONLY
    segment: tuple[int, int] = (0, 1)
    roll: float = 1.0
    advance: float = 1.0
    length: float = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        pair = FeatureBlock("segments", marks=self.segment, components=(3,))
        if len(pair.marks or ()) != 2:
            raise InputError(f"segment: expected two marks, got {self.segment!r:.80}")
        put(self, "segment", pair.marks)
        law = PartitionedLaw(self.roll, self.advance, self.length)
        for name in ("roll", "advance", "length"):
            put(self, name, getattr(law, name))
        area = FeatureBlock("region_moments", components=(0,))
        put(self, "features", [FeatureBlock("points"), pair, area])
        put(self, "law", law)
        super().__post_init__()

    def bound_law(self, regulated: Regulated) -> PartitionedLaw:
        """The law; InputError if no joint moves the camera along its optical axis."""
        if np.abs(regulated.at_goal.J[2]).max() < 1e-9:
            raise InputError(
                "the partitioned scheme moves the camera along its optical axis, and no commanded "
                f"joint moves '{regulated.sights[0].eye.name}' so"
            )
        law: PartitionedLaw = self.law
        return law


SCHEMES: dict[str, type[ServoTask]] = {
    each.kind: each for each in (IBVS, PBVS, Hybrid, Partitioned)
}
