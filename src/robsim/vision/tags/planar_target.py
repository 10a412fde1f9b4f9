"""What is printed on a plane: where its ink is, and its picture."""

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

    It has a `name`, under which a detector delivers its `marks` (N, 3), the points that this finds,
    the corners ((left, top), (right, bottom)) of its `paper` with a margin, and the `pitch` of its
    cells or squares, all in metres; `is_black` tells where among points of its plane is ink.
    """

    def picture(self: Any, pixels: int = 20) -> NDArray[np.uint8]:
        """Return its picture (h, w), black 0 and white 255, to print or to show.

        `pixels` is the side of one cell of a tag, or of one square of a board. Printed so that the
        black square of a tag, or the squares of a board, have their size, it is what is detected.
        """
        (left, top), (right, bottom) = self.paper
        step = self.pitch / as_integer(pixels, "pixels", 1, MOST_PIXELS)
        count = [round((end - begin) / step) for begin, end in ((left, right), (top, bottom))]
        as_integer(max(count), "pixels of a side of the picture", 1, MOST_PIXELS)
        x, y = (step * (np.arange(n) + 0.5) for n in count)
        ink = self.is_black(*np.meshgrid(left + x, top + y))
        return np.where(ink, 0, 255).astype(np.uint8)
