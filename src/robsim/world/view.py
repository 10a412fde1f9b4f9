"""What a camera sees of some points."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array


class View(NamedTuple):
    """What a camera sees: pixels (..., N, 2), depth (..., N) in metres, `Visibility` (..., N)."""

    pixels: Array
    depth: Array
    visibility: NDArray[np.int8]
