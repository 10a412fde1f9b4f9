"""The drives: how the joints of a chunk of runs follow a command, and steps of encoders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.kernels import actuation as kernels
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene


class Period(NamedTuple):
    """A control period: where it began, and what was commanded; the run last."""

    q: Array  # (nq, B)
    rates: Array  # (nv, B) velocities when it began
    qd: Array  # (nv, B)


@dataclass(frozen=True, eq=False)
class Drives:
    """The drives of the joints of a scene, of which `columns` are commanded."""

    actuation: Actuation
    scene: Scene
    columns: NDArray[np.int64]

    def advance(self, held: Period, dt: float) -> tuple[Array, Array]:
        """Return coordinates (nq, B) and velocities (nv, B) after a period."""
        return self._after(held, dt, dt)

    def moved(self, held: Period, seconds: float, dt: float) -> Array:
        """Return coordinates (nq, B) some time after a period began that lasts dt."""
        return held.q if seconds == 0.0 else self._after(held, seconds, dt)[0]

    def _after(self, held: Period, seconds: float, dt: float) -> tuple[Array, Array]:
        """Return coordinates and velocities some time after a period began.

        Cars steer once in a period, when it begins.
        """
        tree, q = self.scene.tree, held.q.copy()
        if tree.cars:
            tree.steer(q, self._velocities(held, dt)[1], dt)
        rates, mean = self._velocities(held, seconds)
        tree.roll(q, mean, seconds)
        return q, tree.driven(q, rates)

    def _velocities(self, held: Period, seconds: float) -> tuple[Array, Array]:
        """Return velocities (nv, B) after some time, and their mean until then."""
        return self._follow(held, seconds) if self.actuation.moves else (held.qd, held.qd)

    def _follow(self, held: Period, dt: float) -> tuple[Array, Array]:
        """Return velocities (nv, B) at the end, and their mean; uncommanded ones are as given."""
        wanted = np.ascontiguousarray(held.qd[self.columns])
        v, mean = held.rates[self.columns], np.empty(wanted.shape)
        kernels.follow(wanted, self.actuation.lag, *self.limits, dt, v, mean)
        after, between = held.qd.copy(), held.qd.copy()
        after[self.columns], between[self.columns] = v, mean
        return after, between

    @property
    def moves(self) -> bool:
        """Whether joints move otherwise than commanded, as does a car that must steer."""
        return self.actuation.moves or bool(self.scene.tree.cars)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """The limits of velocity and acceleration of the commanded velocities."""
        velocity, acceleration = (
            frozen(self.actuation.limits(which, self.scene.nv)[self.columns])
            for which in ("velocity", "acceleration")
        )
        return velocity, acceleration

    @cached_property
    def steps(self) -> Array:
        """The encoder step of each coordinate (nq,); zero where a joint has no encoder."""
        steps = np.zeros(self.scene.nq)
        given = np.full(self.scene.nq, self.actuation.encoder, dtype=float)
        counted = self.scene.tree.alone(np.arange(self.scene.nv))
        counted = counted[counted >= 0]
        steps[counted] = given[counted]
        return frozen(steps)
