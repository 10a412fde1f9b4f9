"""Random numbers for studies, which depend on the seed and the row but not on the count."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array, runs_first
from robsim.kernels.formulas import random

WORKSPACE, PROBES, SUITES = 16, 17, 24  # streams; those below 16 are for sensors in a run


def uniform(seed: int, stream: int, count: int, n: int) -> Array:
    """Return (count, n) uniform numbers in (0, 1), of which a row does not depend on the count.

    >>> bool((uniform(1, WORKSPACE, 9, 3)[:5] == uniform(1, WORKSPACE, 5, 3)).all())
    True
    """
    out = np.empty((n, count))
    random.uniforms(np.uint64(seed), np.arange(count, dtype=np.uint64), 0, stream, out)
    return runs_first(out, (count,))
