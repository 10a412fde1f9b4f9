"""Random numbers of a study: each depends on the seed, the name and the draw, and on no other."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.formulas import random

MOST_EVEN = 2**30  # points of Sobol's sequence in SciPy
STREAM = 18  # those below 16 are of sensors in a run, 16 and 17 of robsim.analysis.draws


@dataclass(frozen=True)
class Draws:
    """The random numbers of one varied name for some draws, by their numbers.

    `attempt` counts how often a draw was taken again. `evenly` are how many numbers of the study
    are drawn by Sobol's sequence, and the first of them that is this name's.
    """

    seed: int
    name: str
    numbers: NDArray[np.int64]
    attempt: int = 0
    evenly: tuple[int, int] = (0, 0)

    def uniform(self, count: int) -> Array:
        """Return `count` numbers in (0, 1) for each draw, (draws, count)."""
        out = np.empty((count, len(self.numbers)))
        random.uniforms(*self._key, self.attempt, STREAM, out)
        return np.ascontiguousarray(out.T)

    def normal(self, count: int) -> Array:
        """Return `count` standard normal numbers for each draw, (draws, count)."""
        out = np.empty(((count + 1) // 2, 2, len(self.numbers)))
        random.normal_pairs(*self._key, self.attempt, STREAM, out)
        return np.ascontiguousarray(out.reshape(-1, len(self.numbers))[:count].T)

    def even(self, count: int) -> Array:
        """Return `count` coordinates of each point of Sobol's sequence, scrambled, in (0, 1)."""
        try:
            from scipy.stats import qmc
        except ImportError:
            raise InputError("Sobol's sequence needs SciPy: pip install 'robsim[store]'") from None
        dimensions, first = self.evenly
        engine = qmc.Sobol(dimensions, rng=np.random.default_rng(self.seed))
        low, high = int(self.numbers.min()), int(self.numbers.max())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of counts that are no power of two
            if low:
                engine.fast_forward(low)
            points = engine.random(high - low + 1)
        chosen = points[self.numbers - low, first : first + count]
        return np.asarray(np.clip(chosen, 2.0**-53, 1.0 - 2.0**-53))

    @property
    def _key(self) -> tuple[np.uint64, NDArray[np.uint64]]:
        text = f"{self.seed}:{self.name}".encode()
        seed = int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "little")
        return np.uint64(seed), self.numbers.astype(np.uint64)
