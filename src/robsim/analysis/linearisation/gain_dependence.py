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

NEGLIGIBLE = 1e-6  # share of a command below which it is what differences round off
EQUAL_RATE = 1e-6  # share of a rate within which two are one


@dataclass(frozen=True, eq=False)
class GainDependence:
    """The command (r, r) of a motion: fixed + factor * growing, each of what is now and seen.

    What is fixed does not depend on the gain, as a secondary motion. Motions are those that are
    ever commanded: what the features leave free has no part in it.
    """

    now: Array
    seen: Array
    fixed_now: Array
    fixed_seen: Array

    @classmethod
    def of(cls, response: LinearResponse, doubled: LinearResponse | None) -> Self:
        """Return it from the responses at all gains and at twice these; None: all of it grows."""
        now, seen = response.inside(response.now), response.inside(response.seen)
        if doubled is None:
            return cls(now, seen, np.zeros_like(now), np.zeros_like(seen))
        twice = response.inside(doubled.now), response.inside(doubled.seen)
        more_now, more_seen = twice[0] - now, twice[1] - seen
        return cls(more_now, more_seen, now - more_now, seen - more_seen)

    @property
    def proportional(self) -> bool:
        """Whether all of the command grows with the gains."""
        return self._nothing(self.fixed_now, self.fixed_seen)

    @cached_property
    def plain(self) -> bool:
        """Whether what grows follows from the image alone, and what is fixed is apart from it.

        As a secondary motion, which is projected to where it does not move the features.
        """
        U = self._served
        return self._nothing(self.now, self.fixed_seen, U.T @ self.fixed_now)

    @cached_property
    def _served(self) -> Array:
        """An orthonormal basis of the velocities that are commanded because of the image."""
        U, sigma, _ = np.linalg.svd(self.seen)
        return np.asarray(U[:, sigma > NEGLIGIBLE * sigma[0]])

    def _nothing(self, *parts: Array) -> bool:
        return all(np.abs(A).max() <= NEGLIGIBLE * np.abs(self.seen).max() for A in parts)

    def at(self, factor: float, timing: LoopDelays) -> DiscreteLoop:
        """Return the loop with gains multiplied by a factor."""
        seen, now = factor * self.seen + self.fixed_seen, factor * self.now + self.fixed_now
        return DiscreteLoop(seen, now, timing)

    @cached_property
    def rates(self) -> Matrix:
        """The rates (r,) per second at which motions decay without any delay, slowest first."""
        found = -np.linalg.eigvals(self.now + self.seen + self.fixed_now + self.fixed_seen)
        return found[np.argsort(found.real, kind="stable")]

    @property
    def modes(self) -> list[complex]:
        """The rates of what the image commands, each once, of a pair that is complex one."""
        U, kept = self._served, list[complex]()
        for rate in -np.linalg.eigvals(U.T @ self.seen @ U):
            if rate.imag >= 0.0 and all(abs(rate - one) > EQUAL_RATE * abs(rate) for one in kept):
                kept.append(complex(rate))
        return kept


def make_mode_loop(rate: complex, timing: LoopDelays) -> DiscreteLoop:
    """Return the loop of a single mode, which decays at this rate where nothing is late."""
    return DiscreteLoop(np.array([[-rate]]), np.zeros((1, 1)), timing)
