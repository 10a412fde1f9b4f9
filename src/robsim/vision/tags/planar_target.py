"""A target printed on a plane: its black area, and its picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import as_integer
from robsim.base.value import Value

MOST_PIXELS = 10_000  # of a side of a picture
BoolArray = NDArray[np.bool_]


class PlanarTarget(Value):
    """A tag or a board on white paper, with x to the right, y down and z into the paper, in metres.

    Subclasses define the `name` of the target in `Detections`, its `marks` (N, 3), which a detector
    measures, the corners ((left, top), (right, bottom)) of the `paper` with a margin, and the
    `pitch` of its cells or squares. `is_black` returns whether points of the plane are black.
    """

    def picture(self: Any, pixels: int = 20) -> NDArray[np.uint8]:
        """Return a picture (h, w) of the target to print or to show, black 0 and white 255.

        Print it so that the black square of a tag, or the squares of a board, have their declared
        size.

        Parameters
        ----------
        pixels : int, default 20
            Side of one cell of a tag, or of one square of a board, in pixels.
        """
        (left, top), (right, bottom) = self.paper
        step = self.pitch / as_integer(pixels, "pixels", 1, MOST_PIXELS)
        count = [round((end - begin) / step) for begin, end in ((left, right), (top, bottom))]
        as_integer(max(count), "pixels of a side of the picture", 1, MOST_PIXELS)
        x, y = (step * (np.arange(n) + 0.5) for n in count)
        ink = self.is_black(*np.meshgrid(left + x, top + y))
        return np.where(ink, 0, 255).astype(np.uint8)
