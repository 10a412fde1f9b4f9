"""The response of a task as a function of a factor of its gains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from robsim.analysis.linearisation.discrete_loop import DiscreteLoop, Matrix
from robsim.analysis.linearisation.linear_response import LinearResponse
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.base.arrays import Array

NEGLIGIBLE = 1e-6  # share of a command below which a part is a rounding error
EQUAL_RATE = 1e-6  # relative difference below which two rates are equal


@dataclass(frozen=True, eq=False)
class GainDependence:
    """Response (r, r) as a function of a factor of the gains: fixed part + factor * growing part.

    `now` and `seen` are the growing parts for measured joints and for images, `fixed_now` and
    `fixed_seen` the fixed parts, such as a secondary motion. Motions are restricted to the
    commanded velocities; motions that the features leave free are excluded.
    """

    now: Array
    seen: Array
    fixed_now: Array
    fixed_seen: Array

    @classmethod
    def of(cls, response: LinearResponse, doubled: LinearResponse | None) -> Self:
        """Return the dependence from the responses at the gains and at twice the gains.

        With `doubled` None the whole response is proportional to the gains.
        """
        now, seen = response.inside(response.now), response.inside(response.seen)
        if doubled is None:
            return cls(now, seen, np.zeros_like(now), np.zeros_like(seen))
        twice = response.inside(doubled.now), response.inside(doubled.seen)
        more_now, more_seen = twice[0] - now, twice[1] - seen
        return cls(more_now, more_seen, now - more_now, seen - more_seen)

    @property
    def is_proportional(self) -> bool:
        """Whether the whole command is proportional to the gains."""
        return self._is_negligible(self.fixed_now, self.fixed_seen)

    @cached_property
    def is_image_only(self) -> bool:
        """Whether the growing part depends on the image alone, apart from the fixed part.

        This holds for a secondary motion that is projected so that it does not move the features.
        """
        U = self._image_basis
        return self._is_negligible(self.now, self.fixed_seen, U.T @ self.fixed_now)

    @cached_property
    def _image_basis(self) -> Array:
        """An orthonormal basis of the velocities that the image commands."""
        U, sigma, _ = np.linalg.svd(self.seen)
        return np.asarray(U[:, sigma > NEGLIGIBLE * sigma[0]])

    def _is_negligible(self, *parts: Array) -> bool:
        """Return whether all arrays are negligible beside `seen`."""
        return all(np.abs(A).max() <= NEGLIGIBLE * np.abs(self.seen).max() for A in parts)

    def at(self, factor: float, timing: LoopDelays) -> DiscreteLoop:
        """Return the loop with all gains multiplied by a factor."""
        seen, now = factor * self.seen + self.fixed_seen, factor * self.now + self.fixed_now
        return DiscreteLoop(seen, now, timing)

    @cached_property
    def rates(self) -> Matrix:
        """The decay rates (r,) of the motions without delay, in 1/s, slowest first."""
        rates = -np.linalg.eigvals(self.now + self.seen + self.fixed_now + self.fixed_seen)
        return rates[np.argsort(rates.real, kind="stable")]

    @property
    def modes(self) -> list[complex]:
        """The distinct rates of the motions that the image commands, one for each complex pair."""
        U, distinct = self._image_basis, list[complex]()
        for rate in -np.linalg.eigvals(U.T @ self.seen @ U):
            if rate.imag >= 0.0 and all(
                abs(rate - other) > EQUAL_RATE * abs(rate) for other in distinct
            ):
                distinct.append(complex(rate))
        return distinct


def make_mode_loop(rate: complex, timing: LoopDelays) -> DiscreteLoop:
    """Return the loop of a single mode that decays at this rate without delay."""
    return DiscreteLoop(np.array([[-rate]]), np.zeros((1, 1)), timing)
