"""Curves that rails follow, by arc length: line, arc, polyline with round corners, catenary.

A curve lies in the plane z = 0 of the frame that it is given in. It begins at its first point (of
a line and an arc the origin, along x), and goes on straight before it and after its end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, frozen, numbers, positive
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.kernels import curve as kernels

MOST_POINTS = 1000
HUGE = 1e150  # its square is a number


class Curve:
    """What all curves have in common; a subclass says of which pieces it is made."""

    @cached_property
    def pieces(self) -> Array:
        """(P, 7), see `robsim.kernels.curve.Curves`."""
        raise NotImplementedError

    if TYPE_CHECKING:

        @property
        def length(self) -> float:
            """Metres."""

    @cached_property
    def constants(self) -> kernels.Curves:
        """For the kernels, as the only curve."""
        ends = frozen(np.array([0, len(self.pieces)], dtype=np.int64))
        return kernels.Curves(ends, frozen(np.array([self.length])), self.pieces)

    @cached_property
    def spans(self) -> Array:
        """(P,) metres of each piece."""
        return frozen(np.diff(self.pieces[:, 0], append=self.length))

    @cached_property
    def bends(self) -> tuple[float, float]:
        """The lowest and the highest curvature, per metre; 0 is that of the straight ends.

        >>> Arc(2.0, -math.pi).bends
        (-0.5, 0.0)
        """
        lowest = self.pieces[:, 0] - self.pieces[:, 6]  # point of a catenary: it bends most there
        bends = self.curvature(np.clip(lowest, 0.0, self.length))
        bends = np.concatenate([[0.0], self.pieces[:, 4], bends[self.pieces[:, 5] > 0]])
        return float(bends.min()), float(bends.max())

    def at(self, s: ArrayLike) -> Pose:
        """Pose (..., 4, 4) at arc length s (...,) metres: x along the curve, z out of its plane.

        >>> Arc(2.0, math.pi).at(math.pi).position.round(12)
        array([2., 2., 0.])
        """
        x, y, c, d, _ = self._points(s)
        T = np.zeros((*x.shape, 4, 4))
        T[..., 0, 0], T[..., 0, 1], T[..., 1, 0], T[..., 1, 1] = c, -d, d, c
        T[..., 2, 2] = T[..., 3, 3] = 1.0
        T[..., 0, 3], T[..., 1, 3] = x, y
        return Pose(T)

    def curvature(self, s: ArrayLike) -> Array:
        """(...,) per metre, positive where the curve turns left.

        >>> float(Arc(2.0, math.pi).curvature(1.0))
        0.5
        """
        return self._points(s)[4]

    def nearest(self, points: ArrayLike) -> tuple[Array, Array]:
        """Arc length and distance (...,) of the point of the curve nearest to points (..., 2).

        >>> [float(x) for x in Line(3.0).nearest([1.0, 0.5])]
        [1.0, 0.5]
        """
        given = numbers(points, "points", (2,))
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

    def _check(self) -> None:
        """InputError if its numbers are beyond what can be computed with."""
        try:
            with np.errstate(all="ignore"):
                good = bool((np.abs([*self.pieces.ravel(), self.length]) < HUGE).all())
        except ArithmeticError:
            good = False
        if not good:
            raise InputError(f"numbers too large or too small for a curve: {self!r:.200}")

    def _points(self, s: ArrayLike) -> tuple[Array, ...]:
        """x, y, cos, sin, curvature, each (...,)."""
        given = numbers(s, "arc length s (metres)", ())
        rows = [kernels.point(self.constants, 0, value) for value in given.ravel().tolist()]
        columns = np.array(rows).reshape(*given.shape, 5)
        return tuple(columns[..., i] for i in range(5))


@dataclass(frozen=True)
class Line(Curve):
    """Straight along x; `length` in metres.

    >>> Line(3.0).at(2.0).position
    array([2., 0., 0.])
    """

    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", positive(self.length, "length of a line"))

    @cached_property
    def pieces(self) -> Array:
        """One."""
        return frozen(np.zeros((1, 7)))


@dataclass(frozen=True)
class Arc(Curve):
    """A part of a circle of `radius` metres, by `angle` radians: left if positive, right if not.

    >>> round(Arc(2.0, -math.pi / 2).length, 9)
    3.141592654
    """

    radius: float
    angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive(self.radius, "radius of an arc"))
        angle = float(numbers(self.angle, "angle of an arc (radians)", ()))
        object.__setattr__(self, "angle", angle)
        if angle == 0.0:
            raise InputError("angle of an arc (radians) must not be 0; a Line goes straight")
        self._check()

    @property
    def length(self) -> float:
        """Metres."""
        return self.radius * abs(self.angle)

    @cached_property
    def pieces(self) -> Array:
        """One."""
        return frozen(np.array([[0, 0, 0, 0, math.copysign(1 / self.radius, self.angle), 0, 0.0]]))


@dataclass(frozen=True)
class Polyline(Curve):
    """Straight from point to point (x, y), each corner an arc of `radius` metres.

    >>> round(Polyline([(0, 0), (1, 0), (1, 1)], radius=0.2).length, 9)  # 0.8 + 0.1 pi + 0.8
    1.914159265
    """

    points: Any  # (N, 2), kept as a tuple of pairs
    radius: float

    def __post_init__(self) -> None:
        given = numbers(self.points, "points of a polyline", ("N", 2))
        if given.ndim != 2 or not 2 <= len(given) <= MOST_POINTS:
            raise InputError(
                f"points of a polyline: expected (N, 2) with N from 2 to {MOST_POINTS}, "
                f"got {given.shape}"
            )
        points = tuple((float(x), float(y)) for x, y in given)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "radius", positive(self.radius, "radius of the corners"))
        self._check()

    @property
    def length(self) -> float:
        """Metres."""
        return float(self._built[1])

    @cached_property
    def pieces(self) -> Array:
        """Lines and arcs by turns."""
        return frozen(self._built[0])

    @cached_property
    def _built(self) -> tuple[Array, float]:
        ways = np.diff(np.array(self.points), axis=0)
        lengths, directions = np.hypot(*ways.T), np.arctan2(ways[:, 1], ways[:, 0])
        if not lengths.all():
            i = int(np.argmin(lengths))
            raise InputError(f"points {i} and {i + 1} of a polyline are one: {self.points[i]}")
        turns = _wrapped(np.diff(directions))
        cut = self.radius * np.abs(np.tan(0.5 * turns))  # what each corner takes of its sides
        before, after = np.r_[0.0, cut], np.r_[cut, 0.0]
        rest = lengths - before - after
        if (rest < 0).any():
            i = int(np.argmin(rest))
            raise InputError(
                f"corners of radius {self.radius:g} m do not fit between points {i} and {i + 1} of "
                f"a polyline, {lengths[i]:g} m apart"
            )
        rows, s = [], 0.0
        for i, direction in enumerate(directions):
            t = np.array([math.cos(direction), math.sin(direction)])
            first = np.array(self.points[i]) + before[i] * t
            rows.append([s, *first, direction, 0.0, 0.0, 0.0])
            s += rest[i]
            if i < len(turns) and turns[i] != 0.0:
                last = np.array(self.points[i + 1]) - after[i] * t
                k = math.copysign(1.0 / self.radius, turns[i])
                rows.append([s, *last, direction, k, 0.0, 0.0])
                s += self.radius * abs(turns[i])
        return np.array(rows), s


@dataclass(frozen=True)
class Catenary(Curve):
    """A cable that hangs from `start` to `end`, (x, y) with y up, `length` metres long.

    Its parameter a solves sqrt(length^2 - v^2) = 2 a sinh(h/(2 a)) for h across and v up (e.g.
    H. M. Irvine, Cable Structures, 1981).

    >>> cable = Catenary((0, 0), (10, 0), 10.2)
    >>> cable.at(5.1).position.round(3)  # its middle hangs lowest
    array([ 5.   , -0.872,  0.   ])
    """

    start: Any
    end: Any
    length: float

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            given = numbers(getattr(self, name), f"{name} of a catenary", (2,))
            if given.ndim != 1:
                raise InputError(f"{name} of a catenary: expected (x, y), got {given.shape}")
            object.__setattr__(self, name, (float(given[0]), float(given[1])))
        length = positive(self.length, "length of a catenary")
        object.__setattr__(self, "length", length)
        apart = math.dist(self.start, self.end)
        if self.end[0] <= self.start[0]:
            raise InputError(
                f"a catenary goes to larger x, from {self.start[0]:g} not to {self.end[0]:g}"
            )
        if length <= apart * (1 + 1e-9):
            raise InputError(
                f"a catenary of {length:g} m does not hang between points {apart:g} m apart; "
                "make it longer, or take a Line"
            )
        self._check()

    @cached_property
    def parameter(self) -> float:
        """a, metres: the radius of curvature at the lowest point."""
        h: float = self.end[0] - self.start[0]
        v: float = self.end[1] - self.start[1]
        apart = math.hypot(h, v)
        ratio = math.sqrt((self.length - v) * (self.length + v)) / h  # sinh(z)/z with z = h/(2a)
        excess = (self.length - apart) * (self.length + apart) / (h * h) / (ratio + 1.0)
        z = math.sqrt(6.0 * excess) if ratio < 3.0 else math.log(2.0 * ratio) + 1.0
        for _ in range(100):  # Newton on a convex function, from the right
            value, slope = _sinhc_excess(z)
            step = (value - excess) / slope
            z -= step
            if abs(step) <= 1e-16 * z:
                break
        return h / (2.0 * z)

    @cached_property
    def pieces(self) -> Array:
        """One."""
        h, v, a = self.end[0] - self.start[0], self.end[1] - self.start[1], self.parameter
        middle = a * math.atanh(v / self.length)  # of the span, from the lowest point
        u = a * math.sinh((middle - 0.5 * h) / a)
        return frozen(np.array([[0.0, *self.start, math.atan2(u, a), 0.0, a, u]]))


def _sinhc_excess(z: float) -> tuple[float, float]:
    """sinh(z)/z - 1 and its derivative, for z > 0, without cancellation."""
    if z > 1.0:
        return math.sinh(z) / z - 1.0, (math.cosh(z) - math.sinh(z) / z) / z
    value = slope = 0.0
    for n in range(12, 0, -1):  # the terms z^(2n) / (2n + 1)!, nested
        factor = 1.0 / ((2 * n) * (2 * n + 1))
        slope = factor * (2.0 * z * (1.0 + value) + z * z * slope)
        value = factor * z * z * (1.0 + value)
    return value, slope


def _wrapped(angle: Array) -> Array:
    """In [-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
