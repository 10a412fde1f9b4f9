"""How joints move otherwise than they are commanded, and how they are measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robsim.arrays import Array, frozen, not_negative, numbers, positive
from robsim.errors import InputError
from robsim.kernels.actuation import follow

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

    >>> Actuation(lag=0.1).velocity_after([1.0], seconds=0.1)
    array([0.63212056])
    """

    lag: float = 0.0
    velocity: Each | None = None
    acceleration: Each | None = None
    encoder: Each = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "lag", not_negative(self.lag, "lag (seconds)"))
        for name in ("velocity", "acceleration"):
            given = getattr(self, name)
            put(self, name, None if given is None else _each(given, f"{name} limit", False))
        put(self, "encoder", _each(self.encoder, "encoder step", True))

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

    def velocity_after(self, command: Any, seconds: float, start: Any = 0.0) -> Array:
        """Velocities (n,) after a command (n,) was held for some time, from velocities `start`.

        InputError: `start`, or a limit for each, is not of as many velocities as the command.
        """
        wanted = np.atleast_1d(numbers(command, "command", ()))
        first = numbers(start, "start", ())
        if wanted.ndim > 1 or first.shape not in ((), wanted.shape):
            raise InputError(
                "command and start: expected shapes (n,) and (n,) or one number, got "
                f"{wanted.shape} and {first.shape}"
            )
        replace(self, encoder=0.0).check([f"velocity {i}" for i in range(wanted.size)], ())
        v = np.broadcast_to(first, wanted.shape).copy()[:, None]
        limits = (self.limits(name, wanted.size) for name in ("velocity", "acceleration"))
        mean = np.empty(v.shape)
        follow(wanted[:, None], self.lag, *limits, positive(seconds, "seconds"), v, mean)
        return v[:, 0]


def _each(value: Any, what: str, zero: bool) -> float | tuple[float, ...]:
    given = numbers(value, what, ())
    low = (given >= 0).all() if zero else (given > 0).all()
    if given.ndim > 1 or not given.size or not low:
        sign = "not below 0" if zero else "above 0"
        raise InputError(
            f"{what}: expected a number {sign}, or one for each, got {given.tolist()!r:.80}"
        )
    return tuple(given.tolist()) if given.ndim else float(given)
