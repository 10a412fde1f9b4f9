"""The fields that some servo tasks have, in groups: each acts in every task that has it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, ClassVar

from robsim.declare import PerRun
from robsim.servo.feature_block import FEATURES_SPEC
from robsim.servo.laws.broyden_rule import INTERACTION
from robsim.servo.laws.depth_model import DEPTH, DEPTH_SCALE, Depth
from robsim.servo.laws.feed_forward import FEED_FORWARD
from robsim.servo.laws.gain import GAIN, AdaptiveGain
from robsim.servo.laws.inverse import INVERSE
from robsim.servo.laws.law import LAW
from robsim.servo.tasks.task import ServoTask
from robsim.servo.weightings.weighting_protocol import WEIGHTING_LIST

TaskGain = Annotated[
    float | AdaptiveGain, GAIN, PerRun(()), "Rate at which e falls: a constant, or adaptive."
]


@dataclass(frozen=True, eq=False)
class FeatureFields(ServoTask):
    """The features of a task that lets them be chosen."""

    group: ClassVar[str] = "features"
    features: Annotated[
        Any, FEATURES_SPEC, "Feature that is regulated, or several, which are stacked."
    ] = "points"


@dataclass(frozen=True, eq=False)
class DepthFields(ServoTask):
    """The depth of a task whose features, or their interaction matrix, are made with it."""

    group: ClassVar[str] = "depth"
    _: KW_ONLY
    depth: Annotated[
        Depth, DEPTH, "Depth Z of the marks in L: true, at the goal, constant, or filtered."
    ] = "true"
    depth_scale: Annotated[
        Any,
        DEPTH_SCALE,
        PerRun((), ("N",), rows=True),
        "Factor of the depths in L, which makes them wrong on purpose.",
    ] = 1.0


@dataclass(frozen=True, eq=False)
class LawFields(ServoTask):
    """The law of a task that lets it be chosen, and what goes into it."""

    group: ClassVar[str] = "law"
    _: KW_ONLY
    interaction: Annotated[
        Any,
        INTERACTION,
        "Interaction matrix L: now, at the goal, the mean of both, a constant (k, 6), or learnt.",
    ] = "current"
    law: Annotated[
        Any, LAW, "Law from e to joint velocities: a kind, or an object with command(state)."
    ] = "joint"
    gain: TaskGain = 1.0
    inverse: Annotated[Any, INVERSE, "Inverse of L or L J in the law."] = "pseudo_inverse"
    feed_forward: Annotated[
        Any,
        FEED_FORWARD,
        "Compensation of target motion: known from the scene, or estimated; None: none.",
    ] = None


@dataclass(frozen=True, eq=False)
class WeightingFields(ServoTask):
    """The weightings of a task whose marks can count less."""

    group: ClassVar[str] = "weighting"
    _: KW_ONLY
    weighting: Annotated[
        Any,
        WEIGHTING_LIST,
        "What makes a mark count less than others; the weights of several multiply.",
    ] = ()
