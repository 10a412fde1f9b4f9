"""Limits of the velocities and accelerations of joints that follow their command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import PerRun, register
from robsim.declare.joint_numbers import OneOrEach, check_joint_count, get_velocity_axes
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.joint_effect import JointEffect, JointEffectStage, JointResponse

PerJointLimit = float | Sequence[float] | Array  # one number for all joints, or one for each
VelocityBound = Annotated[
    PerJointLimit | None,
    OneOrEach(get_velocity_axes, "/s"),
    PerRun((), ("n",)),
    "Limit of |v|; commands are clipped joint by joint. None: no limit.",
]
AccelerationBound = Annotated[
    PerJointLimit | None,
    OneOrEach(get_velocity_axes, "/s^2"),
    PerRun((), ("n",)),
    "Limit of |v'|. None: no limit.",
]


class RateLimit(JointEffect):
    """Base class of limits of the joints; `limited` names the field with the limit."""

    place: ClassVar[JointEffectStage] = JointEffectStage.FOLLOWED
    left_out: ClassVar[str] = "limits of velocity and acceleration"
    limited: ClassVar[str]

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        check_joint_count(getattr(self, self.limited), self.limited, velocities)

    def response(self, count: int) -> JointResponse:
        return JointResponse.of(count, **{self.limited: getattr(self, self.limited)})

    def stated(self, facts: RunFacts) -> Statement:
        limits = getattr(self.response(facts.wanted.shape[1]), self.limited)
        rates = (facts.wanted - facts.moved) / facts.dt
        needed = facts.wanted if self.limited == "velocity" else rates
        share = float((np.abs(needed) > limits)[:, facts.columns].any(axis=1).mean())
        sentence = (
            f"The {self.limited} limits of the joints change the command in {100 * share:.3g} "
            "percent of the periods, and with it the direction of the motion."
        )
        return sentence, {"share": share}


@register("joint effect", "velocity")
@dataclass(frozen=True)
class VelocityLimit(RateLimit):
    """A limit of the velocity of each joint; commands are clipped.

    Examples
    --------
    >>> VelocityLimit([0.5, 1.0]).response(2).velocity
    array([0.5, 1. ])
    """

    title: ClassVar[str] = "velocity limits"
    limited: ClassVar[str] = "velocity"
    velocity: VelocityBound


@register("joint effect", "acceleration")
@dataclass(frozen=True)
class AccelerationLimit(RateLimit):
    """A limit of the acceleration of each joint.

    Examples
    --------
    >>> AccelerationLimit(2.0).response(1).acceleration
    array([2.])
    """

    title: ClassVar[str] = "acceleration limits"
    limited: ClassVar[str] = "acceleration"
    acceleration: AccelerationBound
