"""A square tag of AprilTag or ArUco."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from itertools import groupby
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array, as_integer, as_positive
from robsim.base.unit_warnings import warn_of_millimetres
from robsim.declare import Integer, Length, PerRun, Role, described
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Block
from robsim.vision.tags.planar_target import THICK, BoolArray, PlanarTarget, list_ink_rectangles
from robsim.vision.tags.tag_families import FAMILY, black_cells, find_tag_family

CORNERS = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])


def tag_name(family: str, number: int) -> str:
    """Return the name of a tag.

    >>> tag_name("tag36h11", 7)
    'tag36h11_7'
    """
    return f"{family}_{number}"


@described
@dataclass(frozen=True, eq=False)
class Tag(PlanarTarget):
    """A square tag of AprilTag ("tag36h11", ...) or ArUco ("DICT_4X4_50", ...).

    The origin is the middle of the tag, with x to the right, y down and z into the paper. An
    upright tag that faces a camera therefore has the orientation of the camera. The marks are the
    corners of the black square: upper left, upper right, lower right, lower left. Upright is the
    orientation in the pictures of the authors of the family. OpenCV prints AprilTags upside down;
    rotate such prints by 180 degrees.

    Raises
    ------
    InputError
        If the family does not exist or has no tag of this number, or the size is not positive.

    Examples
    --------
    >>> tag = Tag("tag36h11", 7, size=0.1)
    >>> tag.name, tag.marks[0]
    ('tag36h11_7', array([-0.05, -0.05,  0.  ]))
    """

    family: Annotated[str, FAMILY, Role.FIGURE, "Family of the tag."]
    id: Annotated[int, Integer(), Role.FIGURE, "Number of the tag in its family."]
    size: Annotated[float, Length(above=0), PerRun(()), "Side of the black square, in metres."]

    def __post_init__(self) -> None:
        as_integer(self.id, f"id of a tag of {self.family}", 0, find_tag_family(self.family).ids)
        object.__setattr__(self, "id", int(self.id))
        what = "size of a tag in metres"
        object.__setattr__(self, "size", as_positive(self.size, what))
        warn_of_millimetres(self.size, what)

    @property
    def name(self) -> str:
        """The name of the tag in `Detections`: its family and number."""
        return tag_name(self.family, self.id)

    @property
    def marks(self) -> Array:
        """The corners (4, 3) of the black square in metres, clockwise from the upper left.

        In a batch with tags of different sizes (runs,) they are (4, 3, runs).
        """
        return np.asarray(np.multiply.outer(CORNERS, self.size))

    @property
    def pitch(self) -> float:
        """The side of a cell in metres."""
        return self.size / find_tag_family(self.family).cells

    @property
    def paper(self) -> Array:
        """The corners ((left, top), (right, bottom)) of the paper, with a margin of one cell."""
        half = self.size / 2 + self.pitch
        return np.array([[-half, -half], [half, half]])

    @property
    def cells(self) -> BoolArray:
        """Whether the cells (n, n) of the upright tag are black, with the border."""
        cells = black_cells(self.family, self.id)
        return cells[::-1, ::-1] if find_tag_family(self.family).april else cells

    @property
    def ink(self) -> Array:
        """The black rectangles (R, 4): left, top, right and bottom in metres."""
        return list_ink_rectangles(self.cells, self.pitch, -self.size / 2, -self.size / 2)

    def is_black(self, x: Array, y: Array) -> BoolArray:
        """Return whether points (...) of the plane, in metres, are black."""
        cells = self.cells
        column, row = (np.floor((v + self.size / 2) / self.pitch).astype(int) for v in (x, y))
        inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < len(cells))
        i, j = (np.clip(v, 0, len(cells) - 1) for v in (row, column))
        return np.asarray(inside & cells[i, j])

    @property
    def shapes(self) -> tuple[Block, ...]:
        """The shapes of the tag for a scene: white paper, and black plates for its cells.

        Consecutive black cells of a row share one plate. An object with these shapes also needs the
        `marks` of the tag. Without the extra `vision`, all cells are black.
        """
        thick, step, (_, (edge, _)) = THICK * self.size, self.pitch, self.paper
        paper = Block(2 * edge, 2 * edge, thick, "w", pose=Pose.at(0, 0, 1.5 * thick))
        shapes = [paper]
        n = find_tag_family(self.family).cells
        cells = self.cells if find_spec("cv2") else np.full((n, n), True)
        for row, line in enumerate(cells):
            for is_ink, run in groupby(range(len(line)), key=lambda i: bool(line[i])):
                columns = list(run)
                middle = (columns[0] + columns[-1] + 1 - len(line)) / 2 * step
                place = Pose.at(middle, (row + 0.5 - len(line) / 2) * step, thick / 2)
                plate = Block(len(columns) * step, step, thick, "k", pose=place)
                shapes += [plate] if is_ink else []
        return tuple(shapes)
