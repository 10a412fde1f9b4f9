"""Random numbers for studies: the same bits for the same seed, however many are drawn."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array, runs_first
from robsim.kernels import random

WORKSPACE, PROBES = 16, 17  # streams; those below are for what sensors do in a run


def uniform(seed: int, stream: int, count: int, n: int) -> Array:
    """(count, n) numbers between 0 and 1, exclusive: row by row, whatever the count.

    >>> bool((uniform(1, WORKSPACE, 9, 3)[:5] == uniform(1, WORKSPACE, 5, 3)).all())
    True
    """
    out = np.empty((n, count))
    random.uniforms(np.uint64(seed), np.arange(count, dtype=np.uint64), 0, stream, out)
    return runs_first(out, (count,))
