"""Features of image moments: area, centre, orientation, and six decoupled features.

`robsim.kernels.formulas.image_moments` defines the centres centre[2, b], the moments mu[k, b] and
their rates R[k, 6, b].
"""

import math

import numpy as np

from robsim.kernels.formulas.image_moments import (
    ORDER_3,
    ORDER_4,
    fit_inverse_depth_plane,
    mark_moment_rates,
    put_mark_moments,
    put_region_moments,
    region_moment_rates,
)
from robsim.kernels.formulas.lane_math import arc_tangent
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage

ANGLE_VOTE = 0.8  # weight of a small rotation against contradicting third moments
ROOT_3 = math.sqrt(3.0)


@part
def _moment_size(of_marks, m, b):
    """Return the size: mu00 for a region, mu20 + mu02 for a set of marks."""
    return m[3, b] + m[5, b] if of_marks else m[0, b]


@part
def _moment_size_rate(of_marks, R, c, b):
    """Return the rate of the size for a unit of twist component c."""
    return R[3, c, b] + R[5, c, b] if of_marks else R[0, c, b]


@part
def _orientation(mu, b):
    """Return the angle of the principal axis."""
    return 0.5 * arc_tangent(2.0 * mu[4, b], mu[3, b] - mu[5, b])


@part
def _orientation_rate(xx, xy, yy, dxx, dxy, dyy):
    """Return the rate of the orientation from the second moments and their rates."""
    across, twice = xx - yy, 2.0 * xy
    turn = across * 2.0 * dxy - twice * (dxx - dyy)
    return 0.5 * turn / (across * across + twice * twice)


@entry("float64[::1], out float64[::1]", inline="always")
def within_quarter_turn(goal, alpha):
    """Add multiples of pi to alpha[b], to within a quarter turn of the goal, in place."""
    for b in range(alpha.shape[0]):
        turns = (alpha[b] - goal[b]) / math.pi
        alpha[b] -= math.pi * math.floor(turns + 0.5)


@entry("float64[:, ::1], float64[::1], out float64[:, ::1]")
def head_vector(mu, alpha, out):
    """Compute out[4, b], the dimensionless third moments in axes of alpha[b].

    With the complex moments p = mu30 + mu12 + i (mu21 + mu03) and t = mu30 - 3 mu12 + i (3 mu21 -
    mu03), the vector is sqrt(mu00 / spread) / spread times (sqrt(3) p exp(-i alpha),
    t exp(-3 i alpha)), with the spread mu20 + mu02. Its length is twice the length of the tensor of
    third moments and does not change if the image rotates (Flusser 2000, "On the independence of
    rotation moment invariants", Pattern Recognition 33). For alpha + pi it changes its sign, so it
    has a direction, unlike the axis.
    """
    for b in range(alpha.shape[0]):
        spread = mu[3, b] + mu[5, b]
        scale = math.sqrt(mu[0, b] / spread) / spread
        px, py = ROOT_3 * (mu[6, b] + mu[8, b]), ROOT_3 * (mu[7, b] + mu[9, b])
        tx, ty = mu[6, b] - 3.0 * mu[8, b], 3.0 * mu[7, b] - mu[9, b]
        c, s = math.cos(alpha[b]), math.sin(alpha[b])
        c3, s3 = math.cos(3.0 * alpha[b]), math.sin(3.0 * alpha[b])
        out[0, b], out[1, b] = scale * (c * px + s * py), scale * (c * py - s * px)
        out[2, b], out[3, b] = scale * (c3 * tx + s3 * ty), scale * (c3 * ty - s3 * tx)


@entry("float64[::1], float64[:, ::1], float64[:, ::1], out float64[::1]")
def resolve_half_turn(goal, head_goal, mu, alpha):
    """Add pi to alpha[b], or subtract it, if the third moments contradict the goal, in place.

    Let h be the vector of `head_vector`, and h* this vector at the goal. If two images differ by a
    rotation, h = h*, or h = -h* if the axis points in the opposite direction. A tilt of the camera
    changes h, so the angle has a vote of weight ANGLE_VOTE: alpha is kept if
    h.h* / max(|h|, |h*|)^2 + ANGLE_VOTE cos(alpha - goal) >= 0. Both terms change their signs with
    alpha + pi, so the result does not jump at a quarter turn.
    """
    h = np.empty((4, alpha.shape[0]))
    head_vector(mu, alpha, h)
    for b in range(alpha.shape[0]):
        square, own_square, along = 0.0, 0.0, 0.0
        for i in range(4):
            square += head_goal[i, b] * head_goal[i, b]
            own_square += h[i, b] * h[i, b]
            along += h[i, b] * head_goal[i, b]
        share = along / max(square, own_square)
        if share + ANGLE_VOTE * math.cos(alpha[b] - goal[b]) < 0.0:
            alpha[b] += math.pi if alpha[b] < goal[b] else -math.pi


@entry("bool, float64[:, ::1], float64[:, ::1], out float64[:, ::1]", inline="always")
def basic_moments(of_marks, centre, mu, s):
    """Compute s[4, b] = (a, xg, yg, alpha), alpha = atan2(2 mu11, mu20 - mu02) / 2."""
    for b in range(mu.shape[1]):
        s[0, b], s[1, b], s[2, b] = _moment_size(of_marks, mu, b), centre[0, b], centre[1, b]
        s[3, b] = _orientation(mu, b)


@part
def put_basic_moment_rates(w, of_marks, mu, R, L):
    """Write L (4, 6) of (a, xg, yg, alpha), from the rates R (k, 6) of the moments."""
    xx, xy, yy = get(w, mu + 3), get(w, mu + 4), get(w, mu + 5)
    for c in range(6):
        dxx, dxy, dyy = get(w, R + 18 + c), get(w, R + 24 + c), get(w, R + 30 + c)
        put(w, L + c, dxx + dyy if of_marks else get(w, R + c))
        put(w, L + 6 + c, get(w, R + 6 + c))
        put(w, L + 12 + c, get(w, R + 12 + c))
        put(w, L + 18 + c, _orientation_rate(xx, xy, yy, dxx, dxy, dyy))


@part
def _skewness(mu, b):
    """Return (rho, px, py, spread): p = sum of r^2 (x, y), and the dimensionless length rho."""
    px, py, spread = mu[6, b] + mu[8, b], mu[7, b] + mu[9, b], mu[3, b] + mu[5, b]
    rho = math.sqrt(mu[0, b] * (px * px + py * py) / spread) / spread
    return rho, px, py, spread


@entry("bool, float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], out float64[:, ::1]")
def decoupled_moments(of_marks, size_goal, Z_goal, centre, mu, s):
    """Compute s[6, b] = (xn, yn, an, Px, Py, alpha), an = Z* sqrt(a* / a), xn = an xg, yn = an yg.

    (Px, Py) = rho (cos 2 phi, sin 2 phi), with the dimensionless length rho of
    p = (mu30 + mu12, mu21 + mu03) and the angle phi of p from the principal axis. The angle is
    doubled because the axis has no direction.
    """
    for b in range(mu.shape[1]):
        an = Z_goal[b] * math.sqrt(size_goal[b] / _moment_size(of_marks, mu, b))
        rho, px, py, _spread = _skewness(mu, b)
        alpha = _orientation(mu, b)
        twice = 2.0 * (arc_tangent(py, px) - alpha)
        s[0, b], s[1, b], s[2, b] = an * centre[0, b], an * centre[1, b], an
        s[3, b], s[4, b], s[5, b] = rho * math.cos(twice), rho * math.sin(twice), alpha


@entry(
    "bool, float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], "
    "out float64[:, :, ::1]"
)
def decoupled_moment_rates(of_marks, centre, mu, R, s, L):
    """Compute L[6, 6, b] of the decoupled s[6, b], from the rates R[k, 6, b] of the moments."""
    for c in range(6):
        for b in range(mu.shape[1]):
            an = s[2, b]
            an_rate = (
                -0.5 * an * _moment_size_rate(of_marks, R, c, b) / _moment_size(of_marks, mu, b)
            )
            _rho, px, py, spread = _skewness(mu, b)
            dx, dy, square = R[6, c, b] + R[8, c, b], R[7, c, b] + R[9, c, b], px * px + py * py
            dxx, dxy, dyy = R[3, c, b], R[4, c, b], R[5, c, b]
            alpha_rate = _orientation_rate(mu[3, b], mu[4, b], mu[5, b], dxx, dxy, dyy)
            growth = (px * dx + py * dy) / square + 0.5 * R[0, c, b] / mu[0, b]
            growth -= 1.5 * (dxx + dyy) / spread
            turn = 2.0 * ((px * dy - py * dx) / square - alpha_rate)
            L[0, c, b] = an_rate * centre[0, b] + an * R[1, c, b]
            L[1, c, b] = an_rate * centre[1, b] + an * R[2, c, b]
            L[2, c, b] = an_rate
            L[3, c, b] = growth * s[3, b] - turn * s[4, b]
            L[4, c, b] = growth * s[4, b] + turn * s[3, b]
            L[5, c, b] = alpha_rate


@stage
def marks_stage(
    w,
    step,
    N="count",
    points="N, 2",
    depth="N",
    centre="2",
    mu="o",
    R="m, 6",
    L="2*N, 6",
    o="count",
    m="count",
):
    """Compute the moments of a set of N marks, and their rates. `L` are scratch rows."""
    put_mark_moments(w, N, points, centre, mu)
    mark_moment_rates(w, N, points, depth, centre, R, L)


@stage
def region_stage(
    w,
    step,
    N="count",
    points="N, 2",
    depth="N",
    centre="2",
    mu="o",
    R="m, 6",
    ABC="3",
    terms="o",
    o="count",
    m="count",
):
    """Compute the moments of a polygon with N corners, and their rates.

    `terms` are scratch rows.
    """
    put_region_moments(w, N, points, centre, mu, terms)
    centre, mu, ABC = vector(w, centre, 2), vector(w, mu, ORDER_4), vector(w, ABC, 3)
    fit_inverse_depth_plane(matrix(w, points, N, 2), vector(w, depth, N), ABC)
    region_moment_rates(ABC, centre, mu, matrix(w, R, ORDER_3, 6))


@stage
def basic_stage(
    w,
    step,
    of_marks="whole",
    centre="2",
    mu="o",
    R="m, 6",
    goal="1 or none",
    s="4",
    L="4, 6",
    o="count",
    m="count",
):
    """Compute s = (size, xg, yg, alpha) and L, with alpha near the angle of the goal."""
    of_marks, s = of_marks != 0, vector(w, s, 4)
    basic_moments(of_marks, vector(w, centre, 2), vector(w, mu, ORDER_3), s)
    if goal >= 0:
        within_quarter_turn(vector(w, goal, 1)[0], s[3])
    put_basic_moment_rates(w, of_marks, mu, R, L)


@stage
def decoupled_stage(
    w,
    step,
    of_marks="whole",
    centre="2",
    mu="o",
    R="m, 6",
    goal="7",
    has_angle="whole",
    has_heading="whole",
    s="6",
    L="6, 6",
    o="count",
    m="count",
):
    """Compute s and L of the decoupled moments.

    The seven rows of the goal are size, depth, angle and the vector of `head_vector`. `has_angle`
    is nonzero if the goal has an angle, and `has_heading` if it has this vector.
    """
    of_marks, centre, mu = of_marks != 0, vector(w, centre, 2), vector(w, mu, ORDER_3)
    goal, s = vector(w, goal, 7), vector(w, s, 6)
    decoupled_moments(of_marks, goal[0], goal[1], centre, mu, s)
    if has_angle:
        within_quarter_turn(goal[2], s[5])
    if has_heading:
        resolve_half_turn(goal[2], goal[3:], mu, s[5])
    decoupled_moment_rates(of_marks, centre, mu, matrix(w, R, ORDER_3, 6), s, matrix(w, L, 6, 6))
