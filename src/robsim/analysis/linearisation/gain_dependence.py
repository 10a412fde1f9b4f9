"""The response of a task as a function of a factor of its gains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from robsim.analysis.linearisation.discrete_loop import DiscreteLoop
from robsim.analysis.linearisation.linear_plant import Matrix
from robsim.analysis.linearisation.linear_response import LinearResponse
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.base.arrays import Array

NEGLIGIBLE = 1e-6  # share of a command below which a part is a rounding error
EQUAL_RATE = 1e-6  # relative difference below which two rates are equal


@dataclass(frozen=True, eq=False)
class GainDependence:
    """Response (r, r) as a function of a factor of the gains: fixed part + factor * growing part.

    `joint_part` and `image_part` are the growing parts for measured joints and for images,
    `fixed_joint_part` and `fixed_image_part` the fixed parts, such as a secondary motion. Motions
    are restricted to the commanded velocities; motions that the features leave free are excluded.
    """

    joint_part: Array
    image_part: Array
    fixed_joint_part: Array
    fixed_image_part: Array

    @classmethod
    def of(cls, response: LinearResponse, doubled: LinearResponse | None) -> Self:
        """Return the dependence from the responses at the gains and at twice the gains.

        With `doubled` None the whole response is proportional to the gains.
        """
        now, seen = (
            response.restrict_map(response.joint_part),
            response.restrict_map(response.image_part),
        )
        if doubled is None:
            return cls(now, seen, np.zeros_like(now), np.zeros_like(seen))
        twice = response.restrict_map(doubled.joint_part), response.restrict_map(doubled.image_part)
        more_now, more_seen = twice[0] - now, twice[1] - seen
        return cls(more_now, more_seen, now - more_now, seen - more_seen)

    @property
    def is_proportional(self) -> bool:
        """Whether the whole command is proportional to the gains."""
        return self._is_negligible(self.fixed_joint_part, self.fixed_image_part)

    @cached_property
    def is_image_only(self) -> bool:
        """Whether the growing part depends on the image alone, apart from the fixed part.

        This holds for a secondary motion that is projected so that it does not move the features.
        """
        U = self._image_basis
        return self._is_negligible(
            self.joint_part, self.fixed_image_part, U.T @ self.fixed_joint_part
        )

    @cached_property
    def _image_basis(self) -> Array:
        """An orthonormal basis of the velocities that the image commands."""
        U, sigma, _ = np.linalg.svd(self.image_part)
        return np.asarray(U[:, sigma > NEGLIGIBLE * sigma[0]])

    def _is_negligible(self, *parts: Array) -> bool:
        """Return whether all arrays are negligible beside `image_part`."""
        return all(np.abs(A).max() <= NEGLIGIBLE * np.abs(self.image_part).max() for A in parts)

    def at(self, factor: float, timing: LoopDelays) -> DiscreteLoop:
        """Return the loop with all gains multiplied by a factor."""
        seen, now = (
            factor * self.image_part + self.fixed_image_part,
            factor * self.joint_part + self.fixed_joint_part,
        )
        return DiscreteLoop(seen, now, timing)

    @cached_property
    def rates(self) -> Matrix:
        """The decay rates (r,) of the motions without delay, in 1/s, slowest first."""
        rates = -np.linalg.eigvals(
            self.joint_part + self.image_part + self.fixed_joint_part + self.fixed_image_part
        )
        return rates[np.argsort(rates.real, kind="stable")]

    @property
    def modes(self) -> list[complex]:
        """The distinct rates of the motions that the image commands, one for each complex pair."""
        U, distinct = self._image_basis, list[complex]()
        for rate in -np.linalg.eigvals(U.T @ self.image_part @ U):
            if rate.imag >= 0.0 and all(
                abs(rate - other) > EQUAL_RATE * abs(rate) for other in distinct
            ):
                distinct.append(complex(rate))
        return distinct


def make_mode_loop(rate: complex, timing: LoopDelays) -> DiscreteLoop:
    """Return the loop of a single mode that decays at this rate without delay."""
    return DiscreteLoop(np.array([[-rate]]), np.zeros((1, 1)), timing)
