"""The response of joints to commands, and the resolution of their encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from robsim.base.errors import prefix_errors
from robsim.declare import DeclaredValue, described
from robsim.world.imperfections.encoder import Encoder, EncoderSteps
from robsim.world.imperfections.imperfection import ActiveImperfection, list_active_imperfections
from robsim.world.imperfections.joint_effect import (
    FIRST_JOINT_STREAM,
    JointEffect,
    JointEffectList,
    JointEffectStage,
    JointResponse,
)
from robsim.world.imperfections.lag import Lag, LagTime
from robsim.world.imperfections.rate_limits import (
    AccelerationBound,
    AccelerationLimit,
    VelocityBound,
    VelocityLimit,
)


@described
@dataclass(frozen=True)
class Actuation(DeclaredValue):
    """Joints with lag and limits, and encoders with a finite step.

    Limits are one number for all velocities of the scene, or one for each; steps likewise for its
    coordinates, of which those of other joints are not counted. Each is off by default. Only
    commanded velocities lag and are limited; every joint starts at rest. A floating or planar
    joint and a unicycle are moved by their mean velocity over each period, all others exactly.

    >>> Actuation(lag=0.1, velocity=[0.5, 1.0]).response(2).velocity
    array([0.5, 1. ])
    """

    lag: LagTime = 0.0
    velocity: VelocityBound = None
    acceleration: AccelerationBound = None
    encoder: EncoderSteps = 0.0
    effects: JointEffectList = ()

    def acting(self) -> list[ActiveImperfection[JointEffect]]:
        """Return the imperfections that are on, in the order of the fields."""
        return self._acting

    @cached_property
    def _acting(self) -> list[ActiveImperfection[JointEffect]]:
        return list_active_imperfections(self, ACTUATION_PARTS, JointEffect, FIRST_JOINT_STREAM)

    @property
    def moves(self) -> bool:
        """Whether joints respond otherwise than commanded."""
        return any(each.effect.place < JointEffectStage.MEASURED for each in self.acting())

    def response(self, count: int) -> JointResponse:
        """Return how joints follow, of so many velocities of a scene."""
        if count in self._responses:
            return self._responses[count]
        each = (each.effect.response(count) for each in self.acting())
        found = reduce(JointResponse.and_also, each, JointResponse.of(count))
        if self.holds_still:  # and not of a user's effect, which may change
            self._responses[count] = found
        return found

    @cached_property
    def _responses(self) -> dict[int, JointResponse]:
        return {}

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError if an imperfection does not fit the joints, by their names."""
        with prefix_errors("actuation"):
            for each in self.acting():
                each.effect.check(velocities, coordinates)
            self.response(len(velocities))


ACTUATION_PARTS = (Lag, VelocityLimit, AccelerationLimit, Encoder, "effects")
