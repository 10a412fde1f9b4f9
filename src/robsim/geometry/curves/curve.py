"""The base class of plane curves by arc length: pose, curvature, and nearest point."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.declare import Length, family
from robsim.geometry.pose import Pose
from robsim.kernels.formulas import plane_curves as kernels

LARGEST_CURVE_NUMBER = 1e150  # its square is a number
CURVES = family("curve")
CurveLength = Annotated[float, Length(above=0), "Length of the curve."]
CurveRadius = Annotated[float, Length(above=0), "Radius of the curve."]


class Curve:
    """The base class of all curves; a subclass defines the pieces that it is made of."""

    @cached_property
    def pieces(self) -> Array:
        """The pieces (P, 7) of the curve, see `robsim.kernels.formulas.plane_curves.CurveTable`."""
        raise NotImplementedError

    if TYPE_CHECKING:

        @property
        def length(self) -> float:
            """The length of the curve, in metres."""

    @cached_property
    def constants(self) -> kernels.CurveTable:
        """The constants of the curve for the kernels, as the only curve."""
        ends = make_read_only(np.array([0, len(self.pieces)], dtype=np.int64))
        return kernels.CurveTable(ends, make_read_only(np.array([self.length])), self.pieces)

    @cached_property
    def spans(self) -> Array:
        """The length (P,) of each piece, in metres."""
        return make_read_only(np.diff(self.pieces[:, 0], append=self.length))

    @cached_property
    def bends(self) -> tuple[float, float]:
        """The lowest and the highest curvature, per metre; 0 is that of the straight ends.

        >>> from robsim.geometry.curves import Arc
        >>> Arc(2.0, -np.pi).bends
        (-0.5, 0.0)
        """
        lowest = self.pieces[:, 0] - self.pieces[:, 6]  # of a catenary: it bends most there
        bends = self.curvature(np.clip(lowest, 0.0, self.length))
        bends = np.concatenate([[0.0], self.pieces[:, 4], bends[self.pieces[:, 5] > 0]])
        return float(bends.min()), float(bends.max())

    def at(self, s: ArrayLike) -> Pose:
        """Return the pose (..., 4, 4) at arc length s (...,) in metres.

        Its x axis points along the curve, its z axis out of the plane.

        >>> from robsim.geometry.curves import Arc
        >>> Arc(2.0, np.pi).at(np.pi).position.round(12)
        array([2., 2., 0.])
        """
        x, y, c, d, _ = self._points(s)
        T = np.zeros((*x.shape, 4, 4))
        T[..., 0, 0], T[..., 0, 1], T[..., 1, 0], T[..., 1, 1] = c, -d, d, c
        T[..., 2, 2] = T[..., 3, 3] = 1.0
        T[..., 0, 3], T[..., 1, 3] = x, y
        return Pose(T)

    def curvature(self, s: ArrayLike) -> Array:
        """Return the curvature (...,) per metre, positive where the curve turns left.

        >>> from robsim.geometry.curves import Arc
        >>> float(Arc(2.0, np.pi).curvature(1.0))
        0.5
        """
        return self._points(s)[4]

    def nearest(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return arc length and distance (...,) of the curve's point nearest to points (..., 2).

        >>> from robsim.geometry.curves import Line
        >>> [float(x) for x in Line(3.0).nearest([1.0, 0.5])]
        [1.0, 0.5]
        """
        given = as_floats(points, "points", (2,))
        s = np.linspace(0.0, self.length, max(200, 20 * len(self.pieces)))
        x, y, *_ = self._points(s)
        away = np.hypot(given[..., :1] - x, given[..., 1:] - y)
        best, step = s[away.argmin(axis=-1)], s[1]
        low, high = np.maximum(best - step, 0.0), np.minimum(best + step, self.length)
        for _ in range(60):  # bisect on the sign of (p - c(s)) . t(s)
            middle = 0.5 * (low + high)
            x, y, c, d, _ = self._points(middle)
            ahead = (given[..., 0] - x) * c + (given[..., 1] - y) * d > 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        x, y, *_ = self._points(0.5 * (low + high))
        return 0.5 * (low + high), np.hypot(given[..., 0] - x, given[..., 1] - y)

    def check(self) -> None:
        """Raise InputError if its numbers are too large or too small to compute with."""
        try:
            with np.errstate(all="ignore"):
                good = bool(
                    (np.abs([*self.pieces.ravel(), self.length]) < LARGEST_CURVE_NUMBER).all()
                )
        except ArithmeticError:
            good = False
        if not good:
            raise InputError(f"numbers too large or too small for a curve: {format_value(self)}")

    def _points(self, s: ArrayLike) -> tuple[Array, ...]:
        """Return x, y, cosine and sine of the heading, and curvature, each (...,)."""
        given = as_floats(s, "arc length s (metres)", ())
        rows = [kernels.curve_point(self.constants, 0, value) for value in given.ravel().tolist()]
        columns = np.array(rows).reshape(*given.shape, 5)
        return tuple(columns[..., i] for i in range(5))
