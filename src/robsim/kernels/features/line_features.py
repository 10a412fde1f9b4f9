"""Features of several marks: segments, straight lines and vanishing points.

The interaction matrix satisfies sdot = L V_c with the camera's twist V_c = (v, omega) in its axes.
"""

import numpy as np

from robsim.kernels.features.point_features import put_polar_rates, to_polar, unwrap_angle
from robsim.kernels.formulas.interaction import points_interaction, put_point_rates
from robsim.kernels.formulas.lane_math import arc_tangent
from robsim.kernels.formulas.lane_vectors import put_vector
from robsim.kernels.machine.array_views import matrix
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, get, put, sqrt
from robsim.kernels.machine.stages import stage


@part
def _put_half_sum(w, L, other):
    """Replace six rows by their mean with six others, and the others by the difference."""
    for i in range(6):
        before, after = get(w, L + i), get(w, other + i)
        put(w, L + i, 0.5 * (before + after))
        put(w, other + i, after - before)


@part
def _put_line_rates(w, L, c, s, rho, slope, foot):
    """Write L (2, 6) of (rho, theta) of a line with cos theta = c and sin theta = s.

    Its lambdas follow from a plane through the line in space. Along the image of the line 1/Z is
    linear, so lambda_theta is the slope of 1/Z, and -lambda_rho is 1/Z at the foot of the
    perpendicular from the principal point.
    """
    put_vector(w, L, -foot * c, -foot * s, foot * rho)
    put_vector(w, L + 3, (1.0 + rho * rho) * s, -(1.0 + rho * rho) * c, 0.0)
    put_vector(w, L + 6, slope * c, slope * s, -slope * rho)
    put_vector(w, L + 9, -rho * c, -rho * s, -1.0)


@kernel
def intersections(x, p):
    """Compute the intersections p[m, 2, b] of the lines x[4m] x[4m + 1] and x[4m + 2] x[4m + 3]."""
    for m in range(p.shape[0]):
        n = 4 * m
        for b in range(x.shape[2]):
            x0, y0 = x[n, 0, b], x[n, 1, b]
            ux, uy = x[n + 1, 0, b] - x0, x[n + 1, 1, b] - y0
            vx, vy = x[n + 3, 0, b] - x[n + 2, 0, b], x[n + 3, 1, b] - x[n + 2, 1, b]
            dx, dy = x[n + 2, 0, b] - x0, x[n + 2, 1, b] - y0
            t = (dx * vy - dy * vx) / (ux * vy - uy * vx)
            p[m, 0, b], p[m, 1, b] = x0 + t * ux, y0 + t * uy


@stage
def segments_stage(
    w, step, N="count", points="N, 2", depth="N", goal="2*N or none", s="2*N", L="2*N, 6"
):
    """Compute s = (xc, yc, length, angle) and L of N / 2 segments between pairs of marks.

    The angles are near the goal's angles.
    """
    for i in range(0, 2 * N, 4):
        x0, y0 = get(w, points + i), get(w, points + i + 1)
        x1, y1 = get(w, points + i + 2), get(w, points + i + 3)
        put(w, s + i, 0.5 * (x0 + x1))
        put(w, s + i + 1, 0.5 * (y0 + y1))
        length, angle = to_polar(x1 - x0, y1 - y0)
        put(w, s + i + 2, length)
        put(w, s + i + 3, angle)
        if goal >= 0:
            unwrap_angle(w, goal + i + 3, s + i + 3)
        rates, end = L + 6 * i, L + 6 * i + 12
        put_point_rates(w, rates, x0, y0, 1.0 / get(w, depth + i // 2))
        put_point_rates(w, end, x1, y1, 1.0 / get(w, depth + i // 2 + 1))
        _put_half_sum(w, rates, end)
        _put_half_sum(w, rates + 6, end + 6)
        put_polar_rates(w, end, x1 - x0, y1 - y0)


@stage
def lines_stage(w, step, N="count", points="N, 2", depth="N", goal="N or none", s="N", L="N, 6"):
    """Compute s = (rho, theta) and L of N / 2 straight lines through pairs of marks.

    A line is x cos theta + y sin theta = rho, with the direction (-sin theta, cos theta) from the
    first to the second mark. The angles are near the goal's angles.
    """
    for n in range(0, N, 2):
        x0, y0 = get(w, points + 2 * n), get(w, points + 2 * n + 1)
        dx, dy = x0 - get(w, points + 2 * n + 2), get(w, points + 2 * n + 3) - y0
        distance = sqrt(dx * dx + dy * dy)
        cosine, sine = dy / distance, dx / distance
        rho = x0 * cosine + y0 * sine
        put(w, s + n, rho)
        put(w, s + n + 1, arc_tangent(sine, cosine))
        if goal >= 0:
            unwrap_angle(w, goal + n + 1, s + n + 1)
        near, far = 1.0 / get(w, depth + n), 1.0 / get(w, depth + n + 1)
        slope = (far - near) / distance
        foot = near - slope * (y0 * cosine - x0 * sine)
        _put_line_rates(w, L + 6 * n, cosine, sine, rho, slope, foot)


@stage
def intersections_stage(w, step, N="count", points="N, 2", s="k", L="k, 6", k="count"):
    """Compute s and L of N / 4 vanishing points, at infinite depth."""
    M = N // 4
    s = matrix(w, s, M, 2)
    intersections(matrix(w, points, N, 2), s)
    points_interaction(s, np.full((M, WIDTH), np.inf), matrix(w, L, 2 * M, 6))
