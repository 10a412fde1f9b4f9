"""How hard a search of inverse kinematics tries."""

from __future__ import annotations

from typing import Any, NamedTuple

from robsim.base.arrays import positive, whole
from robsim.base.errors import InputError
from robsim.base.threads import processors

FINEST = 1e-12  # metres or radians: smaller errors are rounding


class Effort(NamedTuple):
    """The accuracy and the amount of work of a search."""

    tolerance: float
    iterations: int
    restarts: int
    seed: int
    threads: int

    @classmethod
    def checked(
        cls, tolerance: Any, iterations: Any, restarts: Any, seed: Any, threads: Any
    ) -> Effort:
        """Return checked settings; raise InputError for values that cannot be used."""
        finest = positive(tolerance, "tolerance (metres and radians)")
        if finest < FINEST:
            raise InputError(f"tolerance must be at least {FINEST:g}, got {tolerance!r}")
        return cls(
            finest,
            whole(iterations, "iterations", 1, 10**6),
            whole(restarts, "restarts", 0, 10**5),
            whole(seed, "seed", 0, 2**64),
            whole(processors() if threads is None else threads, "threads", 1, 1025),
        )
