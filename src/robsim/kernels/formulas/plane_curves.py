"""Plane curves by arc length, and the chord between two wheels that roll on a curve.

A curve is a sequence of pieces of constant curvature or of catenaries. It continues straight before
its start and after its end. The centre of a wheel that rolls on the curve is p + radius n with the
curve point p and the normal n, a quarter turn to the left of the tangent t.
"""

import math
from typing import Any, NamedTuple

from robsim.kernels.formulas import se3
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

ANGLE, ARC, HEIGHT, TILT = 0, 1, 2, 3  # quantities of a chord
ROUNDING = 4e-16  # relative


class CurveTable(NamedTuple):
    """The constants of curves: the pieces of curve c are rows first[c] to first[c + 1]."""

    first: Any
    length: Any  # (curves,) arc length of each curve
    # (pieces, 7): arc length, position (2) and direction at its start; curvature; parameter a of a
    # catenary and arc length from its lowest point to the start, both 0 for constant curvature
    pieces: Any


@entry(
    "CurveTable(int64[::1], float64[::1], float64[:, ::1]), int64, float64 -> float64, "
    "float64, float64, float64, float64"
)
def curve_point(curves, curve, s):
    """Return x, y, cos and sin of the direction, and curvature of a curve at arc length s.

    A piece of constant curvature k and length l from direction f0 has the chord sinc(k l/2) l in
    the direction f0 + k l/2. A catenary at arc length u from its lowest point has
    x = a asinh(u/a), y = sqrt(a^2 + u^2), tan f = u/a, k = a/(a^2 + u^2).
    """
    inside = min(max(s, 0.0), curves.length[curve])
    i = curves.first[curve]
    while i + 1 < curves.first[curve + 1] and curves.pieces[i + 1, 0] <= inside:
        i += 1
    x, y, direction, k = curves.pieces[i, 1:5]
    a, u = curves.pieces[i, 5:7]
    along = inside - curves.pieces[i, 0]
    if a > 0.0:
        v = u + along
        rise, length = math.hypot(a, v), math.hypot(a, u)
        x += a * (math.asinh(v / a) - math.asinh(u / a))
        y += (v - u) * (v + u) / (rise + length)
        c, s_, k = a / rise, v / rise, a / (rise * rise)
    else:
        half = 0.5 * k * along
        straight = along * se3.sinc(half)
        x += straight * math.cos(direction + half)
        y += straight * math.sin(direction + half)
        c, s_ = math.cos(direction + 2.0 * half), math.sin(direction + 2.0 * half)
    beyond = s - inside
    if beyond != 0.0:
        k = 0.0
    return x + beyond * c, y + beyond * s_, c, s_, k


@kernel
def wheel_contact(curves, curve, s, radius):
    """Return centre (x, y), cos, sin and |d centre/ds| of a wheel that touches a curve at s."""
    x, y, c, d, k = curve_point(curves, curve, s)
    return x - radius * d, y + radius * c, c, d, 1.0 - radius * k


@kernel
def _second_contact(curves, curve, s, x, y, length, radius):
    """Return the arc length of the second wheel. The first wheel is at s with its centre at (x, y).

    It solves |P2 - P1| = length by Newton steps inside a bracket.
    """
    low, high = s, s + length
    while high > low:  # the straight continuation leads away; far out high == low by rounding
        far = wheel_contact(curves, curve, high, radius)
        if math.hypot(far[0] - x, far[1] - y) >= length:
            break
        low, high = high, high + 0.5 * length
    at = min(s + length, high)
    for _ in range(64):
        X, Y, c, d, rate = wheel_contact(curves, curve, at, radius)
        distance = math.hypot(X - x, Y - y)
        gap = distance - length
        if gap > 0.0:
            high = at
        else:
            low = at
        slope = rate * (c * (X - x) + d * (Y - y)) / distance
        step = at - gap / slope
        if not low <= step <= high:
            step = 0.5 * (low + high)
        if abs(step - at) <= ROUNDING * (abs(at) + length):
            return step
        at = step
    return at


@kernel
def _third_contact(curves, curve, near, far, radius, x, y, ux, uy, at):
    """Return the arc length of a wheel with its centre at the distance `at` along a chord.

    The chord starts at (x, y) in the direction (ux, uy).
    """
    low, high = near, far
    s = near + (far - near) * 0.5
    for _ in range(64):
        X, Y, c, d, rate = wheel_contact(curves, curve, s, radius)
        gap = (X - x) * ux + (Y - y) * uy - at
        if gap > 0.0:
            high = s
        else:
            low = s
        step = s - gap / (rate * (c * ux + d * uy))
        if not low <= step <= high:
            step = 0.5 * (low + high)
        if abs(step - s) <= ROUNDING * (abs(s) + at):
            return step
        s = step
    return s


@kernel
def chord_quantity(curves, curve, s, length, radius, at, quantity):
    """Return a quantity of the chord from the wheel at s, and its derivative by s.

    `quantity` selects ANGLE, the angle of the chord from the tangent at s, or a quantity of a third
    wheel with its centre at the distance `at` along the chord: its arc length ARC, the HEIGHT of
    its centre above the chord, or TILT, the angle of its tangent from the chord.

    P1 and P2 are the wheel centres, P' = (1 - radius k) t, u = (P2 - P1)/length, n its left normal.
    From |P2 - P1| = length: s2' = u.P1'/u.P2'. The chord turns at psi' = n.(P2' s2' - P1')/length,
    and relative to the tangent at psi' - k. From (P3 - P1).u = at, with height h = (P3 - P1).n:
    s3' = (u.P1' - h psi')/(u.P3'), h' = n.(P3' s3' - P1') - at psi'. The tangent there turns
    relative to the chord at k3 s3' - psi'. (Own derivation, checked against central differences.)
    """
    x, y, c, d, rate = wheel_contact(curves, curve, s, radius)
    far = _second_contact(curves, curve, s, x, y, length, radius)
    X, Y, C, D, RATE = wheel_contact(curves, curve, far, radius)
    ux, uy = (X - x) / length, (Y - y) / length
    slope = rate * (ux * c + uy * d) / (RATE * (ux * C + uy * D))
    turn = (ux * (RATE * D * slope - rate * d) - uy * (RATE * C * slope - rate * c)) / length
    if quantity == ANGLE:
        k = curve_point(curves, curve, s)[4]
        return math.atan2(c * uy - d * ux, c * ux + d * uy), turn - k
    touch, height = far, 0.0
    if at < length:
        touch = _third_contact(curves, curve, s, far, radius, x, y, ux, uy, at)
        X, Y, C, D, RATE = wheel_contact(curves, curve, touch, radius)
        height = ux * (Y - y) - uy * (X - x)
        slope = (rate * (ux * c + uy * d) - height * turn) / (RATE * (ux * C + uy * D))
    if quantity == ARC:
        return touch, slope
    if quantity == TILT:
        k = curve_point(curves, curve, touch)[4]
        return math.atan2(ux * D - uy * C, ux * C + uy * D), k * slope - turn
    climb = ux * (RATE * D * slope - rate * d) - uy * (RATE * C * slope - rate * c)
    return height, climb - at * turn
