"""Base class of plane curves by arc length: pose, curvature and nearest point."""

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

LARGEST_CURVE_NUMBER = 1e150  # largest number of a curve: its square does not overflow
CURVES = family("curve")
CurveLength = Annotated[float, Length(above=0), "Length of the curve."]
CurveRadius = Annotated[float, Length(above=0), "Radius of the curve."]


class Curve:
    """Base class of curves in the plane z = 0, parametrised by arc length.

    A subclass defines `pieces` and `length`. A joint of kind "rail" moves along a curve.

    Examples
    --------
    >>> from robsim.geometry.curves import Arc
    >>> isinstance(Arc(2.0, np.pi), Curve)
    True
    """

    @cached_property
    def pieces(self) -> Array:
        """Pieces (P, 7) of the curve, see `robsim.kernels.formulas.plane_curves.CurveTable`."""
        raise NotImplementedError

    if TYPE_CHECKING:

        @property
        def length(self) -> float:
            """Length of the curve, in metres."""

    @cached_property
    def constants(self) -> kernels.CurveTable:
        """Table of this curve alone, in the format of the kernels."""
        ends = make_read_only(np.array([0, len(self.pieces)], dtype=np.int64))
        return kernels.CurveTable(ends, make_read_only(np.array([self.length])), self.pieces)

    @cached_property
    def spans(self) -> Array:
        """Length (P,) of each piece, in metres."""
        return make_read_only(np.diff(self.pieces[:, 0], append=self.length))

    @cached_property
    def bends(self) -> tuple[float, float]:
        """Lowest and highest curvature in 1/m, including the straight continuations (0).

        Examples
        --------
        >>> from robsim.geometry.curves import Arc
        >>> Arc(2.0, -np.pi).bends
        (-0.5, 0.0)
        """
        lowest = (
            self.pieces[:, 0] - self.pieces[:, 6]
        )  # arc length of the largest curvature of a catenary
        bends = self.curvature(np.clip(lowest, 0.0, self.length))
        bends = np.concatenate([[0.0], self.pieces[:, 4], bends[self.pieces[:, 5] > 0]])
        return float(bends.min()), float(bends.max())

    def at(self, s: ArrayLike) -> Pose:
        """Return the poses of the curve at arc lengths.

        Parameters
        ----------
        s : array_like of shape (...)
            Arc lengths in metres.

        Returns
        -------
        Pose of shape (..., 4, 4)
            The x axis is tangent to the curve, the z axis normal to the plane.

        Examples
        --------
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
        """Return the curvature (...) in 1/m at arc lengths s (...) in metres, positive to the left.

        Examples
        --------
        >>> from robsim.geometry.curves import Arc
        >>> float(Arc(2.0, np.pi).curvature(1.0))
        0.5
        """
        return self._points(s)[4]

    def nearest(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return the nearest point of the curve for each of several points.

        Parameters
        ----------
        points : array_like of shape (..., 2)
            Points (x, y) in the plane of the curve, in metres.

        Returns
        -------
        s : ndarray of shape (...)
            Arc length of the nearest point of the curve, in metres, between 0 and `length`.
        distance : ndarray of shape (...)
            Distance to this point, in metres.

        Notes
        -----
        The best of 200 or more samples is refined by bisection.

        Examples
        --------
        >>> from robsim.geometry.curves import Line
        >>> [float(x) for x in Line(3.0).nearest([1.0, 0.5])]
        [1.0, 0.5]
        """
        targets = as_floats(points, "points", (2,))
        s = np.linspace(0.0, self.length, max(200, 20 * len(self.pieces)))
        x, y, *_ = self._points(s)
        away = np.hypot(targets[..., :1] - x, targets[..., 1:] - y)
        best, step = s[away.argmin(axis=-1)], s[1]
        low, high = np.maximum(best - step, 0.0), np.minimum(best + step, self.length)
        for _ in range(60):  # bisect on the sign of (p - c(s)) . t(s)
            middle = 0.5 * (low + high)
            x, y, c, d, _ = self._points(middle)
            ahead = (targets[..., 0] - x) * c + (targets[..., 1] - y) * d > 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        x, y, *_ = self._points(0.5 * (low + high))
        return 0.5 * (low + high), np.hypot(targets[..., 0] - x, targets[..., 1] - y)

    def check(self) -> None:
        """Raise InputError if the numbers are too large or too small to compute with."""
        try:
            with np.errstate(all="ignore"):
                is_usable = bool(
                    (np.abs([*self.pieces.ravel(), self.length]) < LARGEST_CURVE_NUMBER).all()
                )
        except ArithmeticError:
            is_usable = False
        if not is_usable:
            raise InputError(f"numbers too large or too small for a curve: {format_value(self)}")

    def _points(self, s: ArrayLike) -> tuple[Array, ...]:
        """Return x, y, cosine and sine of the heading, and curvature, each (...)."""
        arc_lengths = as_floats(s, "arc length s (metres)", ())
        rows = [
            kernels.curve_point(self.constants, 0, value) for value in arc_lengths.ravel().tolist()
        ]
        columns = np.array(rows).reshape(*arc_lengths.shape, 5)
        return tuple(columns[..., i] for i in range(5))
