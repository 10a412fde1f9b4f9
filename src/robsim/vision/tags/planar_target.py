"""A target that is printed on paper: its black area, and its picture."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_integer
from robsim.base.value import Value

MOST_PIXELS = 10_000  # of a side of a picture
THICK = 1e-3  # thickness of the plates of a target in figures, relative to its size
BoolArray = NDArray[np.bool_]


class PrintedPattern(Protocol):
    """A black pattern on white paper, with x to the right, y down and z into the paper."""

    @property
    def name(self) -> str:
        """The name of the target in `Detections`."""

    @property
    def marks(self) -> Array:
        """The points (N, 3) in metres that a detector measures."""

    @property
    def pitch(self) -> float:
        """The side of a cell or square in metres."""

    @property
    def paper(self) -> Array:
        """The corners ((left, top), (right, bottom)) of the paper in metres, with a margin."""

    @property
    def ink(self) -> Array:
        """The black rectangles (R, 4): left, top, right and bottom in metres."""

    def is_black(self, x: Array, y: Array) -> BoolArray:
        """Return whether points (...) of the plane, in metres, are black."""


class PlanarTarget(Value):
    """A tag or a board on white paper, with x to the right, y down and z into the paper, in metres.

    Subclasses define the properties and the method of `PrintedPattern`.
    """

    def picture(self: PrintedPattern, pixels: int = 20) -> NDArray[np.uint8]:
        """Return a picture of the target to print or to show.

        Scale the print such that the black square of a tag, or the squares of a board, have their
        declared size.

        Parameters
        ----------
        pixels : int, default 20
            Side of one cell of a tag, or of one square of a board, in pixels.

        Returns
        -------
        ndarray of uint8, shape (h, w)
            Grey image, black 0 and white 255.
        """
        (left, top), (right, bottom) = self.paper
        step = self.pitch / as_integer(pixels, "pixels", 1, MOST_PIXELS)
        count = [round((end - begin) / step) for begin, end in ((left, right), (top, bottom))]
        as_integer(max(count), "pixels of a side of the picture", 1, MOST_PIXELS)
        x, y = (step * (np.arange(n) + 0.5) for n in count)
        ink = self.is_black(*np.meshgrid(left + x, top + y))
        return np.where(ink, 0, 255).astype(np.uint8)


def list_ink_rectangles(cells: BoolArray, side: float, left: float, top: float) -> Array:
    """Return the black rectangles (R, 4) of square cells (rows, columns): left, top, right, bottom.

    Consecutive black cells of a row share a rectangle.

    >>> list_ink_rectangles(np.array([[True, True, False, True]]), 0.5, 0.0, 0.0)
    array([[0. , 0. , 1. , 0.5],
           [1.5, 0. , 2. , 0.5]])
    """
    edges = np.diff(np.pad(cells.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    (row, first), (_, end) = np.nonzero(edges == 1), np.nonzero(edges == -1)
    ends = [left + side * first, top + side * row, left + side * end, top + side * (row + 1)]
    return np.column_stack(ends)
