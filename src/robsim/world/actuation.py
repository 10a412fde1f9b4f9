"""The response of joints to commands, and the resolution of their encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from robsim.base.arrays import Array, is_any
from robsim.base.errors import naming
from robsim.declare import Declared, ListOf, Stacked, Time, described
from robsim.declare.joints import (
    OneOrEach,
    accelerations,
    check_count,
    coordinates,
    limits_of,
    velocities,
)
from robsim.world.joint_effects import EFFECT, JointEffect

Each = float | Sequence[float]  # one number for all, or one for each


@described
@dataclass(frozen=True)
class Actuation(Declared):
    """Joints with lag and limits, and encoders with a finite step.

    Limits are one number for all velocities of the scene, or one for each; steps likewise for its
    coordinates, of which those of other joints are not counted. Each is off by default. Only
    commanded velocities lag and are limited; every joint starts at rest. A floating or planar
    joint and a unicycle are moved by their mean velocity over each period, all others exactly.

    >>> Actuation(lag=0.1, velocity=[0.5, 1.0]).limits("velocity", 2)
    array([0.5, 1. ])
    """

    lag: Annotated[
        float,
        Time(least=0),
        Stacked(()),
        "Time constant of a first-order response, v' = (command - v)/lag.",
    ] = 0.0
    velocity: Annotated[
        Each | None,
        OneOrEach(velocities, "numbers", ("turn rate", "speed")),
        "Limit of |v|, at which commands are cut off joint by joint; None: none.",
    ] = None
    acceleration: Annotated[
        Each | None,
        OneOrEach(accelerations, "numbers", ("turn acceleration", "acceleration")),
        "Limit of |v'|; None: none.",
    ] = None
    encoder: Annotated[
        Each,
        OneOrEach(coordinates, "numbers", zero=True),
        "Step in which revolute and prismatic coordinates are measured.",
    ] = 0.0

    effects: Annotated[
        tuple[JointEffect, ...],
        ListOf(EFFECT, most=64, alone=True),
        "Effects of a kind of your own on what is commanded, one after the other.",
    ] = ()

    @property
    def moves(self) -> bool:
        """Whether joints respond otherwise than commanded."""
        limited = self.velocity is not None or self.acceleration is not None
        return bool(is_any(self.lag) or self.effects or limited)

    @property
    def counts(self) -> bool:
        """Whether coordinates are measured in steps."""
        return is_any(self.encoder)

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError unless there is one number for all, or one for each of these names."""
        with naming("actuation"):
            check_count(self.velocity, "velocity", velocities)
            check_count(self.acceleration, "acceleration", velocities)
            check_count(self.encoder, "encoder", coordinates)

    def limits(self, which: str, count: int) -> Array:
        """Return the limits (count,) of the velocity or the acceleration, or infinity."""
        return limits_of(getattr(self, which), count)
