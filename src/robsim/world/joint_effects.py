"""What else may be wrong with joints: effects of a kind that the user brings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.declare import Choice, family
from robsim.world.effects import FIRST_STREAM, Draws, like

JOINT_EFFECTS = family("joint effect")
AFTER_IMAGES = FIRST_STREAM + 1024  # streams of random numbers; those below are of images


@dataclass(frozen=True, eq=False)
class Drive(Draws):
    """The state of the drives at a control instant, for B runs, with the run first.

    time     seconds since the start
    q        coordinates (B, nq) of the scene
    moved    velocities (B, n) of the commanded joints in the period that ends, zero at the start
    """

    time: float
    q: Array
    moved: Array
    step: int
    seed: np.uint64
    runs: NDArray[np.uint64]  # (B,)
    stream: int

    def normal(self, count: int) -> Array:
        """Return independent standard normal numbers (B, count)."""
        rows = self.normal_pairs(-(-count // 2)).reshape(-1, self.runs.size)
        return np.ascontiguousarray(rows[:count].T)


@runtime_checkable
class JointEffect(Protocol):
    """What anything must have to be an effect on joints: a user's class needs no base class.

    Registered with `register("joint effect", "my_effect")`, it has a place in scenario files.
    """

    def driven(self, wanted: Array, drive: Drive) -> Array:
        """Return velocities (B, n) for the period that begins, from those that are wanted."""


EFFECT = Choice(JOINT_EFFECTS, protocol=JointEffect)


def driven(effect: JointEffect, wanted: Array, drive: Drive) -> Array:
    """Return velocities (B, n) after an effect; InputError for a result of another shape."""
    given = effect.driven(frozen(wanted.view()), drive)
    return like(wanted, given, f"{type(effect).__name__}.driven")
