"""Optional fields of servo tasks, in groups that act alike in every task."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, ClassVar

from robsim.declare import PerRun
from robsim.servo.feature_block import FEATURES_SPEC, Features
from robsim.servo.laws.broyden_rule import INTERACTION, Matrix
from robsim.servo.laws.depth_model import DEPTH, DEPTH_SCALE, Depth, Scale
from robsim.servo.laws.feed_forward import FEED_FORWARD, FeedForward
from robsim.servo.laws.gain import GAIN, AdaptiveGain
from robsim.servo.laws.inverse import INVERSE, Inverse
from robsim.servo.laws.law import LAW, LawLike
from robsim.servo.tasks.task import ServoTask
from robsim.servo.weightings.weighting_protocol import WEIGHTING_LIST, Weights

Gain = Annotated[float | AdaptiveGain, GAIN, "Decay rate of e, in 1/s: a constant, or adaptive."]


@dataclass(frozen=True, eq=False)
class FeatureFields(ServoTask):
    """Features of a task with a free choice of features."""

    group: ClassVar[str] = "features"
    features: Annotated[
        Features, FEATURES_SPEC, "Regulated feature, or several features that are stacked."
    ] = "points"


@dataclass(frozen=True, eq=False)
class DepthFields(ServoTask):
    """Depth of a task with features or interaction matrices that depend on depth."""

    group: ClassVar[str] = "depth"
    _: KW_ONLY
    depth: Annotated[
        Depth,
        DEPTH,
        "Depth Z of the marks in L: true, at the goal, constant in metres, or filtered.",
    ] = "true"
    depth_scale: Annotated[
        Scale,
        DEPTH_SCALE,
        PerRun((), ("N",), rows=True),
        "Factor of the depths in L, to study errors of the depth.",
    ] = 1.0


@dataclass(frozen=True, eq=False)
class LawFields(ServoTask):
    """Law of a task with a free choice of law, and the matrices in it."""

    group: ClassVar[str] = "law"
    _: KW_ONLY
    interaction: Annotated[
        Matrix,
        INTERACTION,
        "Interaction matrix L: current, at the goal, the mean of both, a constant (k, 6), or "
        "estimated on line.",
    ] = "current"
    law: Annotated[
        LawLike, LAW, "Law from the error to joint velocities: a kind, or an object with command."
    ] = "joint"
    gain: Annotated[Gain, PerRun(())] = 1.0
    inverse: Annotated[Inverse, INVERSE, "Inverse of L or L J in the law."] = "pseudo_inverse"
    feed_forward: Annotated[
        FeedForward | None,
        FEED_FORWARD,
        "Compensation of the target motion: known from the scene, or estimated; None: none.",
    ] = None


@dataclass(frozen=True, eq=False)
class WeightingFields(ServoTask):
    """Weightings of a task with marks that can count less than others."""

    group: ClassVar[str] = "weighting"
    _: KW_ONLY
    weighting: Annotated[
        Weights,
        WEIGHTING_LIST,
        "Weightings of the marks; the weights of several weightings multiply.",
    ] = ()
