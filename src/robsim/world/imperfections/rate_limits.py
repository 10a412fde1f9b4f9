"""Limits of the velocities and accelerations at which joints follow their command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.declare.joints import OneOrEach, accelerations, check_count, limits_of, velocities
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.joint_effect import JointEffect, JointPlace, Response

Each = float | Sequence[float]  # one number for all, or one for each
Velocity = Annotated[
    Each | None,
    OneOrEach(velocities, "numbers", ("turn rate", "speed")),
    "Limit of |v|, at which commands are cut off joint by joint; None: none.",
]
Acceleration = Annotated[
    Each | None,
    OneOrEach(accelerations, "numbers", ("turn acceleration", "acceleration")),
    "Limit of |v'|; None: none.",
]


@register("joint effect", "velocity")
@dataclass(frozen=True)
class VelocityLimit(JointEffect):
    """A limit of the velocity of each joint, at which commands are cut off.

    >>> VelocityLimit([0.5, 1.0]).response(2).velocity
    array([0.5, 1. ])
    """

    place: ClassVar[JointPlace] = JointPlace.FOLLOWED
    title: ClassVar[str] = "velocity limits"
    left_out: ClassVar[str] = "limits of velocity and acceleration"
    velocity: Velocity

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        check_count(self.velocity, "velocity", velocities)

    def response(self, count: int) -> Response:
        return Response(velocity=limits_of(self.velocity, count))

    def stated(self, facts: RunFacts) -> Statement:
        return _cut("velocity", facts.velocities[0], self.velocity, facts)


@register("joint effect", "acceleration")
@dataclass(frozen=True)
class AccelerationLimit(JointEffect):
    """A limit of the acceleration of each joint.

    >>> AccelerationLimit(2.0).response(1).acceleration
    array([2.])
    """

    place: ClassVar[JointPlace] = JointPlace.FOLLOWED
    title: ClassVar[str] = "acceleration limits"
    left_out: ClassVar[str] = "limits of velocity and acceleration"
    acceleration: Acceleration

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        check_count(self.acceleration, "acceleration", velocities)

    def response(self, count: int) -> Response:
        return Response(acceleration=limits_of(self.acceleration, count))

    def stated(self, facts: RunFacts) -> Statement:
        wanted, actual = facts.velocities
        return _cut("acceleration", (wanted - actual) / facts.dt, self.acceleration, facts)


def _cut(which: str, asked: Array, limit: Each | None, facts: RunFacts) -> Statement:
    """State how often a limit of the joints changed the command."""
    limits = limits_of(limit, asked.shape[1])
    over = (np.abs(asked) > limits)[:, facts.columns].any(axis=1)
    sentence = (
        f"The {which} limits of the joints change the command in {100 * over.mean():.3g} percent "
        "of the periods, and with it the direction of the motion."
    )
    return sentence, {"share": float(over.mean())}
