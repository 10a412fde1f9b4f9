"""Linear maps of joints under held commands: joints with a lag, and joints with drives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from robsim.base.arrays import Array

Matrix = Any  # real, or complex for a single mode

OBSERVED = 1e-7  # least length of a new direction, beside unit vectors


class LinearPlant(Protocol):
    """A linear map of joints under a held command.

    The state consists of the motion, or of coordinates that determine it, and of an inner state.
    """

    @property
    def size(self) -> int:
        """The number of components of the state."""

    def motion(self, state: Matrix) -> Matrix:
        """Return the motion in a state."""

    def advance(self, state: Matrix, u: Matrix, seconds: float) -> Matrix:
        """Return the state after some seconds, at most a period, under a held command u."""


class LagPlant(NamedTuple):
    """n joints whose velocities v follow commands with a time constant: lag v' = u - v.

    The state consists of the motion and the velocity, each (n,).
    """

    n: int
    lag: float

    @property
    def size(self) -> int:
        """The number of components of the state."""
        return 2 * self.n

    def motion(self, state: Matrix) -> Matrix:
        """Return the motion in a state."""
        return state[: self.n]

    def advance(self, state: Matrix, u: Matrix, seconds: float) -> Matrix:
        """Return the state after some seconds under a held command u."""
        motion, v = state[: self.n], state[self.n :]
        if self.lag == 0.0:
            return np.concatenate([motion + seconds * u, u])
        decayed = -math.expm1(-seconds / self.lag)  # decayed share of u - v
        late = (u - v) * (self.lag * decayed)
        return np.concatenate([motion + seconds * u - late, v + (u - v) * decayed])


class StateMap(NamedTuple):
    """Linear map of a state (s,) over a time, from a held command (n,) and held torques (m,)."""

    of_state: Array  # (s, s)
    of_command: Array  # (s, n)
    of_torque: Array  # (s, m)

    def observe(self, P: Array) -> StateMap:
        """Return the map of the coordinates P x, with orthonormal rows P."""
        A, B, E = self
        return StateMap(P @ A @ P.T, P @ B, P @ E)


@dataclass(frozen=True, eq=False)
class DrivePlant:
    """Joints that drives move, reduced to the state that the motion in use depends on.

    Integrals that never act, and motions that no feature shows, are left out: they may drift
    although the loop is stable (the minimal realisation of Kalman 1963, "Mathematical description
    of linear dynamical systems").
    """

    map_over: Callable[[float], StateMap]  # of the whole state, by seconds
    basis: Array  # (r, s) orthonormal rows: the observed part of the state
    output: Array  # (k, r) motion in use
    whole: StateMap  # of the observed part, over a period
    seconds: float  # the period

    @classmethod
    def observe(
        cls, map_over: Callable[[float], StateMap], output: Array, seconds: float
    ) -> DrivePlant:
        """Return the plant with a motion `output` (k, s) of the whole state."""
        whole = map_over(seconds)
        P = find_observed_basis(whole.of_state, output)
        return cls(map_over, P, output @ P.T, whole.observe(P), seconds)

    @property
    def size(self) -> int:
        """The number of components of the state."""
        return len(self.basis)

    def motion(self, state: Matrix) -> Matrix:
        """Return the motion in use in a state."""
        return self.output @ state

    def advance(self, state: Matrix, u: Matrix, seconds: float) -> Matrix:
        """Return the state after some seconds under a held command u."""
        if seconds == 0.0:
            return state
        own = self.whole if seconds == self.seconds else self.map_over(seconds).observe(self.basis)
        return own.of_state @ state + own.of_command @ u


def find_observed_basis(A: Array, C: Array) -> Array:
    """Return orthonormal rows (r, s) that span the observable part of x+ = A x, y = C x."""
    basis: list[Array] = []
    pending = list(C)
    change = A - np.eye(len(A))
    while pending:
        row = pending.pop(0)
        for _ in range(2):  # twice, since rounding leaves a part of the former directions
            for each in basis:
                row = row - (each @ row) * each
        left = float(np.linalg.norm(row))
        if left > OBSERVED:
            basis.append(row / left)
            pending.append(basis[-1] @ change)
    return np.array(basis).reshape(len(basis), len(A))
