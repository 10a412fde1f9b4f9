"""Straight line, and polyline with rounded corners."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import Length, ListOf, Vector, check_fields, register
from robsim.geometry.curves.curve import Curve, CurveLength


@register("curve", "line")
@dataclass(frozen=True)
class Line(Curve):
    """Straight line from the origin along x.

    It is the curve of a straight rail. Its curvature is zero, and its pose at arc length s is the
    translation by (s, 0, 0):

    >>> Line(3.0).at(2.0).position
    array([2., 0., 0.])
    """

    length: CurveLength

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def pieces(self) -> Array:
        """Single piece (1, 7) of the line, in the format of `Curve.pieces`."""
        return make_read_only(np.zeros((1, 7)))


@register("curve", "polyline")
@dataclass(frozen=True)
class Polyline(Curve):
    """Straight lines between points, with each corner rounded by an arc.

    At a corner with the turning angle t, an arc of radius r replaces the length r tan(t / 2) of
    both sides, so consecutive points must be far enough apart.

    Raises
    ------
    InputError
        If two consecutive points are equal, or the arcs of two corners overlap.

    Examples
    --------
    >>> round(Polyline([(0, 0), (1, 0), (1, 1)], radius=0.2).length, 9)  # 0.8 + 0.1 pi + 0.8
    1.914159265
    """

    points: Annotated[
        tuple[tuple[float, float], ...],
        ListOf(Vector("length", 2), 2, 1000),
        "Points (N, 2) of the polyline.",
    ]
    radius: Annotated[float, Length(above=0), "Radius of the arcs at the corners."]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, points: ArrayLike, radius: float) -> None: ...

    def __post_init__(self) -> None:
        check_fields(self)
        self.check()

    @property
    def length(self) -> float:
        """Length of the curve, in metres."""
        return float(self._pieces_and_length[1])

    @cached_property
    def pieces(self) -> Array:
        """Pieces (P, 7), lines and arcs, in the format of `Curve.pieces`."""
        return make_read_only(self._pieces_and_length[0])

    @cached_property
    def _pieces_and_length(self) -> tuple[Array, float]:
        """Pieces (P, 7) and length of the rounded polyline."""
        sides = np.diff(np.array(self.points), axis=0)
        lengths, directions = np.hypot(*sides.T), np.arctan2(sides[:, 1], sides[:, 0])
        if not lengths.all():
            i = int(np.argmin(lengths))
            raise InputError(f"points {i} and {i + 1} of a polyline are equal: {self.points[i]}")
        turns = _wrap_to_pi(np.diff(directions))
        cut = self.radius * np.abs(np.tan(0.5 * turns))  # removed at each corner from its sides
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


def _wrap_to_pi(angle: Array) -> Array:
    """Return angles wrapped to [-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
