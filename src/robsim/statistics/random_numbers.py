"""Counter-based random numbers (Philox), determined by a seed, a name and a row.

Rows can be computed in any order and in any parts. Each name has a number, its stream; streams 0 to
15 are reserved for the sensor noise of runs.
"""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.formulas import random

MOST_EVEN = 2**30  # points of Sobol's sequence in SciPy
WORKSPACE, PROBES, STUDIES, SUITES = 16, 17, 18, 24  # streams of numbers


def uniform(seed: int, stream: int, rows: int | NDArray[Any], n: int, attempt: int = 0) -> Array:
    """Return n uniform numbers in (0, 1) for each row, given by a count or by row numbers.

    >>> some = uniform(1, WORKSPACE, np.array([2, 5]), 3)
    >>> bool((uniform(1, WORKSPACE, 9, 3)[[2, 5]] == some).all())
    True
    """
    keys = np.arange(rows) if isinstance(rows, int) else rows
    out = np.empty((n, len(keys)))
    random.fill_uniform_numbers(np.uint64(seed), keys.astype(np.uint64), attempt, stream, out)
    return np.ascontiguousarray(out.T)


@dataclass(frozen=True)
class RandomNumbers:
    """The random numbers of one name in some draws of a study.

    `numbers` are the numbers of the draws, and `attempt` counts the repetitions of a draw.
    `dimension` is the first dimension of this name in the Sobol sequence of the study.
    """

    seed: int
    name: str
    numbers: NDArray[np.int64]
    attempt: int = 0
    dimension: int = 0

    def uniform(self, count: int) -> Array:
        """Return `count` uniform numbers in (0, 1) for each draw, (draws, count)."""
        return uniform(self._key, STUDIES, self.numbers, count, self.attempt)

    def normal(self, count: int) -> Array:
        """Return `count` standard normal numbers for each draw, (draws, count)."""
        out = np.empty(((count + 1) // 2, 2, len(self.numbers)))
        keys = np.uint64(self._key), self.numbers.astype(np.uint64)
        random.fill_normal_pairs(*keys, self.attempt, STUDIES, out)
        return np.ascontiguousarray(out.reshape(-1, len(self.numbers))[:count].T)

    def sample_sobol_points(self, count: int) -> Array:
        """Return `count` coordinates in (0, 1) of each point of a scrambled Sobol sequence.

        Each dimension has a scrambling of its own, so its coordinates are independent of the number
        of dimensions.
        """
        first = self.dimension
        columns = [self._sample_sobol_dimension(i) for i in range(first, first + count)]
        points = np.stack(columns, axis=-1) if count else np.empty((len(self.numbers), 0))
        return np.clip(points, 2.0**-53, 1.0 - 2.0**-53)

    def _sample_sobol_dimension(self, i: int) -> Array:
        """Return the coordinates (draws,) of the i-th dimension of the Sobol sequence."""
        try:
            from scipy.stats import qmc
        except ImportError:
            raise InputError("Sobol's sequence needs SciPy: pip install 'robsim[store]'") from None
        engine = qmc.Sobol(i + 1, rng=np.random.default_rng([self.seed, i]))
        low, high = int(self.numbers.min()), int(self.numbers.max())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the count may be no power of two
            if low:
                engine.fast_forward(low)
            points = engine.random(high - low + 1)
        return np.asarray(points[self.numbers - low, i])

    @property
    def _key(self) -> int:
        """The key of the counter-based generator, a hash of seed and name."""
        text = f"{self.seed}:{self.name}".encode()
        return int.from_bytes(hashlib.blake2b(text, digest_size=8).digest(), "little")
