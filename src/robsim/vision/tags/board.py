"""A ChArUco board: a chessboard with tags in its white squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_integer, as_positive
from robsim.base.errors import InputError
from robsim.base.unit_warnings import warn_of_millimetres
from robsim.declare import Integer, Length, Role, described
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Block
from robsim.vision.tags.planar_target import THICK, BoolArray, PlanarTarget, list_ink_rectangles
from robsim.vision.tags.tag_families import (
    FAMILY,
    black_cells,
    find_tag_family,
    import_opencv,
    opencv_dictionary,
)

if TYPE_CHECKING:
    from cv2.aruco import CharucoBoard

MOST_SQUARES = 100  # on a side
SQUARES = Integer(2, MOST_SQUARES)


@described
@dataclass(frozen=True, eq=False)
class Board(PlanarTarget):
    """A ChArUco board: a chessboard with tags in its white squares.

    The origin is the upper left corner of the board, with x to the right, y down and z into the
    board. The upper left square is black, as in OpenCV since 4.6 (without its legacy pattern). Tags
    are numbered from 0, row by row. The marks are the inner corners of the chessboard, row by row.

    Raises
    ------
    InputError
        If the tags are not smaller than the squares, or the family has too few tags.

    Examples
    --------
    >>> board = Board("DICT_4X4_50", columns=5, rows=4, square=0.03, tag=0.02)
    >>> board.marks.shape, board.marks[0]
    ((12, 3), array([0.03, 0.03, 0.  ]))
    """

    family: Annotated[str, FAMILY, Role.FIGURE, 'Family of the tags, such as "DICT_4X4_50".']
    columns: Annotated[int, SQUARES, "Number of squares along x."]
    rows: Annotated[int, SQUARES, "Number of squares along y."]
    square: Annotated[float, Length(above=0), "Side of a square, in metres."]
    tag: Annotated[
        float, Length(above=0), Role.FIGURE, "Side of the black square of a tag, in metres."
    ]

    def __post_init__(self) -> None:
        count = find_tag_family(self.family).ids
        for side in ("columns", "rows"):
            n = as_integer(getattr(self, side), f"{side} of a board", 2, MOST_SQUARES + 1)
            object.__setattr__(self, side, n)
        for side in ("square", "tag"):
            length = as_positive(getattr(self, side), f"{side} of a board in metres")
            object.__setattr__(self, side, length)
        if self.tag >= self.square:
            raise InputError(f"tag of {self.tag:g} m: larger than its square, {self.square:g} m")
        warn_of_millimetres(self.square, "square of a board in metres")
        if len(self.ids) > count:
            raise InputError(f"{len(self.ids)} white squares, but {self.family} has {count} tags")

    @property
    def ids(self) -> range:
        """The numbers of the tags."""
        return range(self.columns * self.rows // 2)

    @property
    def name(self) -> str:
        """The name of the board in `Detections`."""
        return f"{self.family}_{self.columns}x{self.rows}"

    @property
    def marks(self) -> Array:
        """The inner corners ((columns - 1)(rows - 1), 3) in metres, row by row."""
        x, y = np.meshgrid(np.arange(1.0, self.columns), np.arange(1.0, self.rows))
        return np.asarray(self.square * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]))

    @property
    def pitch(self) -> float:
        """The side of a square in metres."""
        return self.square

    @property
    def paper(self) -> Array:
        """The corners ((left, top), (right, bottom)) of the paper, with half a square as margin."""
        edge = self.square / 2
        size = self.square * np.array([self.columns, self.rows])
        return np.array([np.full(2, -edge), size + edge])

    @property
    def tag_corners(self) -> Array:
        """The corners (T, 4, 2) of the tags in metres, clockwise from the upper left."""
        whites = self.square * np.argwhere(~self._is_square_black.T)[:, ::-1]
        first = whites + (self.square - self.tag) / 2
        return first[:, None] + self.tag * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])

    @property
    def tag_cells(self) -> BoolArray:
        """Whether the cells (T, n, n) of the tags are black, with their border."""
        return np.stack([black_cells(self.family, number) for number in self.ids])

    @property
    def ink(self) -> Array:
        """The black rectangles (R, 4): left, top, right and bottom in metres."""
        side = self.square
        squares = side * np.argwhere(self._is_square_black)
        pitch = self.tag / find_tag_family(self.family).cells
        tags = [
            list_ink_rectangles(cells, pitch, *corners[0])
            for cells, corners in zip(self.tag_cells, self.tag_corners, strict=True)
        ]
        return np.concatenate([np.hstack([squares, squares + side]), *tags])

    def is_black(self, x: Array, y: Array) -> BoolArray:
        """Return whether points (...) of the plane, in metres, are black."""
        column, row = (np.floor(v / self.square).astype(int) for v in (x, y))
        inside = (np.minimum(column, row) >= 0) & (column < self.columns) & (row < self.rows)
        dark = (column + row) % 2 == 0
        return np.asarray(inside & (dark | self._is_tag_black(x, y, column, row)))

    def _is_tag_black(
        self, x: Array, y: Array, column: NDArray[np.int64], row: NDArray[np.int64]
    ) -> BoolArray:
        """Return whether points in white squares are black cells of a tag."""
        n, margin = find_tag_family(self.family).cells, (self.square - self.tag) / 2
        i, j = (
            np.floor((v - square * self.square - margin) / (self.tag / n)).astype(int)
            for v, square in ((x, column), (y, row))
        )
        patterns = self.tag_cells
        number = np.clip((row * self.columns + column) // 2, 0, len(patterns) - 1)
        at_tag = (np.minimum(i, j) >= 0) & (np.maximum(i, j) < n)
        return np.asarray(at_tag & patterns[number, np.clip(j, 0, n - 1), np.clip(i, 0, n - 1)])

    @property
    def shapes(self) -> tuple[Block, ...]:
        """The shapes of the board for figures: white paper and black squares, without the tags."""
        thick, ((left, top), (right, bottom)) = THICK * self.square, self.paper
        middle = Pose.at((left + right) / 2, (top + bottom) / 2, 1.5 * thick)
        paper = Block(right - left, bottom - top, thick, "w", pose=middle)
        squares = [
            Block(self.square, self.square, thick, "k", pose=Pose.at(x, y, thick / 2))
            for x, y in self.square * (np.argwhere(self._is_square_black) + 0.5)
        ]
        return (paper, *squares)

    @property
    def _is_square_black(self) -> BoolArray:
        """Whether the squares (columns, rows) are black."""
        return np.asarray(np.add.outer(range(self.columns), range(self.rows)) % 2 == 0)

    def as_opencv(self) -> CharucoBoard:
        """Return the board as a `cv2.aruco.CharucoBoard`."""
        size, kind = (self.columns, self.rows), opencv_dictionary(self.family)
        board: CharucoBoard = import_opencv().aruco.CharucoBoard(size, self.square, self.tag, kind)
        return board
