"""A pattern of dots on paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_integer, as_positive, make_read_only
from robsim.base.errors import InputError
from robsim.base.unit_warnings import warn_of_millimetres
from robsim.declare import Flag, Length, ListOf, Role, Vector, described
from robsim.declare.context import Context, Raw
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Block, Wheel
from robsim.vision.tags.planar_target import THICK, BoolArray, PlanarTarget

MARGIN = 2.0  # margin of the paper around the dots, in radii
MOST_DOTS = 1000
CORNERS = 64  # of the polygon that replaces a dot


@dataclass(frozen=True)
class DotPlaces(ListOf):
    """The declaration of points of a plane, an array (N, 2) in Python."""

    def check(self, value: Any, what: str) -> Any:
        points = as_floats(value, what, ("N", 2))
        if points.ndim != 2 or not 1 <= len(points) <= MOST_DOTS:
            raise InputError(f"{what}: expected shape (N, 2), 1 to {MOST_DOTS}, got {points.shape}")
        return make_read_only(points)

    def read(self, raw: Raw, c: Context) -> Any:
        return self.check(np.array(super().read(raw, c)).reshape(-1, 2), "points")


@described
@dataclass(frozen=True, eq=False)
class DotPattern(PlanarTarget):
    """Dots on paper: black on white, or white on black.

    The origin and the axes are those of `points`: x to the right, y down and z into the paper. The
    marks are the centres of the dots.

    Raises
    ------
    InputError
        If the points do not have the shape (N, 2), the radius is not positive, or dots overlap.

    Examples
    --------
    >>> dots = DotPattern.grid(columns=3, rows=2, spacing=0.03, radius=0.008)
    >>> dots.marks.shape, dots.marks[0]
    ((6, 3), array([-0.03 , -0.015,  0.   ]))
    """

    points: Annotated[
        Array,
        DotPlaces(Vector("length", 2), 1, MOST_DOTS, by_hand=False),
        "Centres (N, 2) of the dots, in metres.",
    ]
    radius: Annotated[float, Length(above=0), Role.FIGURE, "Radius of the dots, in metres."]
    bright: Annotated[
        bool, Flag(), Role.FIGURE, "Whether the dots are white and the paper black."
    ] = False

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, points: ArrayLike, radius: float, bright: bool = False) -> None: ...

    def __post_init__(self) -> None:
        points = DotPlaces(Vector("length", 2)).check(self.points, "points of a dot pattern")
        object.__setattr__(self, "points", points)
        what = "radius of a dot in metres"
        object.__setattr__(self, "radius", as_positive(self.radius, what))
        warn_of_millimetres(self.radius, what)
        apart = np.linalg.norm(points[:, None] - points, axis=-1) + np.diag(
            np.full(len(points), np.inf)
        )
        if apart.min() <= 2 * self.radius:
            i, j = np.unravel_index(apart.argmin(), apart.shape)
            raise InputError(f"points {i} and {j} of a dot pattern: their dots overlap")

    @classmethod
    def grid(
        cls, columns: int, rows: int, spacing: float, radius: float, bright: bool = False
    ) -> DotPattern:
        """Return a grid of dots around the origin, row by row.

        Parameters
        ----------
        columns, rows : int
            Number of dots along x and y.
        spacing : float
            Distance of neighbouring dots in metres.
        radius : float
            Radius of the dots in metres.
        bright : bool, default False
            Whether the dots are white and the paper black.

        Examples
        --------
        >>> DotPattern.grid(2, 1, spacing=0.1, radius=0.02).points
        array([[-0.05,  0.  ],
               [ 0.05,  0.  ]])
        """
        counts = [
            as_integer(n, f"{what} of a dot pattern", 1, MOST_DOTS)
            for n, what in ((columns, "columns"), (rows, "rows"))
        ]
        step = as_positive(spacing, "spacing of dots in metres")
        x, y = (step * (np.arange(n) - (n - 1) / 2) for n in counts)
        across, down = np.meshgrid(x, y)
        return cls(np.column_stack([across.ravel(), down.ravel()]), radius, bright)

    @property
    def name(self) -> str:
        """The name of the pattern: its number of dots."""
        return f"dots_{len(self.points)}"

    @property
    def marks(self) -> Array:
        """The centres (N, 3) of the dots in metres.

        The centre of a dot in the image is not exactly the image of its centre: see `DotDetector`.
        """
        return np.column_stack([self.points, np.zeros(len(self.points))])

    @property
    def pitch(self) -> float:
        """The diameter of a dot in metres."""
        return 2 * self.radius

    @property
    def paper(self) -> Array:
        """The corners ((left, top), (right, bottom)) of the paper, with a margin of two radii."""
        margin = (1 + MARGIN) * self.radius
        return np.array([self.points.min(axis=0) - margin, self.points.max(axis=0) + margin])

    @property
    def discs(self) -> Array:
        """The dots as polygons (N, 64, 2) of the same area, in metres.

        Their corners are in the order of the angle from x to y.
        """
        angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
        turn = 2 * np.pi / CORNERS
        size = self.radius * np.sqrt(turn / np.sin(turn))
        unit = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(self.points[:, None] + size * unit)

    def is_black(self, x: Array, y: Array) -> BoolArray:
        """Return whether points (...) of the plane, in metres, are black."""
        (left, top), (right, bottom) = self.paper
        black = np.zeros(np.broadcast(x, y).shape, dtype=bool)
        for column, row in self.points:
            black |= np.hypot(x - column, y - row) < self.radius
        inside = (x >= left) & (x <= right) & (y >= top) & (y <= bottom)
        return np.asarray(inside & ~black if self.bright else black)

    @property
    def shapes(self) -> tuple[Block | Wheel, ...]:
        """The shapes of the pattern for figures: paper, and a disc for each dot."""
        thick, ((left, top), (right, bottom)) = THICK * self.pitch, self.paper
        ink, paper = ("w", "k") if self.bright else ("k", "w")
        middle = Pose.at((left + right) / 2, (top + bottom) / 2, 1.5 * thick)
        sheet = Block(right - left, bottom - top, thick, paper, pose=middle)
        discs = [
            Wheel(self.radius, thick, 24, ink, pose=Pose.at(x, y, thick / 2))
            for x, y in self.points
        ]
        return (sheet, *discs)
