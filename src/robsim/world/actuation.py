"""How joints move otherwise than they are commanded, and how they are measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, frozen, not_negative, one_or_each
from robsim.base.errors import InputError

Each = float | Sequence[float]  # one number for all, or one for each


@dataclass(frozen=True)
class Actuation:
    """Joints that do not follow their command at once, and encoders that count in steps.

    lag           seconds: v' = (command - v) / lag, the time constant of a first-order response
    velocity      limits |v|, rad/s or m/s: what a command exceeds is cut off, joint by joint
    acceleration  limits |v'|, rad/s^2 or m/s^2
    encoder       step of the measured coordinates of revolute and prismatic joints, rad or m

    Limits are one number for all velocities of the scene, or one for each; steps likewise for its
    coordinates, of which those of other joints are not counted. Each is off by default. Only
    commanded velocities lag and are limited; every joint starts at rest. A floating or planar
    joint and a unicycle are moved by their mean velocity over each period, all others exactly.

    >>> Actuation(lag=0.1, velocity=[0.5, 1.0]).limits("velocity", 2)
    array([0.5, 1. ])
    """

    lag: float = 0.0
    velocity: Each | None = None
    acceleration: Each | None = None
    encoder: Each = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "lag", not_negative(self.lag, "lag (seconds)"))
        for name in ("velocity", "acceleration"):
            if getattr(self, name) is not None:
                limit = one_or_each(getattr(self, name), f"{name} limit", "velocity")
                put(self, name, limit)
        put(self, "encoder", one_or_each(self.encoder, "encoder step", "coordinate", zero=True))

    @property
    def moves(self) -> bool:
        """Whether joints move otherwise than they are commanded."""
        return self.lag > 0.0 or self.velocity is not None or self.acceleration is not None

    @property
    def counts(self) -> bool:
        """Whether coordinates are measured in steps."""
        return bool(np.any(self.encoder))

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """InputError if there is not one limit for all, or one for each of these names."""
        for name, owners in (
            ("velocity", velocities),
            ("acceleration", velocities),
            ("encoder", coordinates),
        ):
            given = getattr(self, name)
            if isinstance(given, tuple) and len(given) != len(owners):
                raise InputError(
                    f"actuation: {len(given)} numbers of {name} for {len(owners)}: "
                    f"{', '.join(owners)}"
                )

    def limits(self, which: str, count: int) -> Array:
        """(count,) of the velocity or the acceleration; infinite where there is none."""
        given = getattr(self, which)
        return frozen(np.full(count, math.inf if given is None else given, dtype=float))
