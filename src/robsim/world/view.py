"""The image of points in a camera."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array


class View(NamedTuple):
    """The image of points: pixels (..., N, 2), depth (..., N) in metres, `Visibility` (..., N)."""

    pixels: Array
    depth: Array
    visibility: NDArray[np.int8]
