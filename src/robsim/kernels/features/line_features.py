"""Features of several marks: segments, straight lines and vanishing points.

The interaction matrix satisfies sdot = L V_c with the camera's twist V_c = (v, omega) in its axes.
"""

import math

import numpy as np

from robsim.kernels.features.point_features import polar_rates, to_polar, unwrap_angles
from robsim.kernels.formulas.interaction import points_interaction
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import stage


@kernel
def segments(x, s):
    """Compute s[2n, b] = (xc, yc, length, angle) of segments x[0] to x[1], x[2] to x[3], ..."""
    for n in range(0, x.shape[0], 2):
        i = 2 * n
        for b in range(x.shape[2]):
            x0, y0, x1, y1 = x[n, 0, b], x[n, 1, b], x[n + 1, 0, b], x[n + 1, 1, b]
            s[i, b], s[i + 1, b] = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
            s[i + 2, b], s[i + 3, b] = to_polar(x1 - x0, y1 - y0)


@kernel
def to_segment_rates(x, L):
    """Convert L of the end points x[n, 2, b] to L of `segments`, in place."""
    for n in range(0, x.shape[0], 2):
        i = 2 * n
        for c in range(6):
            for b in range(x.shape[2]):
                dx0, dy0, dx1, dy1 = L[i, c, b], L[i + 1, c, b], L[i + 2, c, b], L[i + 3, c, b]
                along, down = x[n + 1, 0, b] - x[n, 0, b], x[n + 1, 1, b] - x[n, 1, b]
                L[i, c, b], L[i + 1, c, b] = 0.5 * (dx0 + dx1), 0.5 * (dy0 + dy1)
                L[i + 2, c, b], L[i + 3, c, b] = polar_rates(along, down, dx1 - dx0, dy1 - dy0)


@kernel
def line_normal(x0, y0, x1, y1):
    """Return (cos theta, sin theta) of the line from point 0 to point 1, and their distance.

    The line is x cos theta + y sin theta = rho, with the direction (-sin theta, cos theta).
    """
    distance, _ = to_polar(x1 - x0, y1 - y0)
    return (y1 - y0) / distance, (x0 - x1) / distance, distance


@kernel
def line_parameters(x, s):
    """Compute s[n, b] = (rho, theta) of lines from x[0] to x[1], from x[2] to x[3], ..."""
    for n in range(0, x.shape[0], 2):
        for b in range(x.shape[2]):
            x0, y0 = x[n, 0, b], x[n, 1, b]
            c, s_, _ = line_normal(x0, y0, x[n + 1, 0, b], x[n + 1, 1, b])
            s[n, b], s[n + 1, b] = x0 * c + y0 * s_, math.atan2(s_, c)


@kernel
def lines_interaction(x, Z, L):
    """Compute L[n, 6, b] of `line_parameters` through marks x[n, 2, b] at depths Z[n, b].

    Its lambdas follow from a plane through the line in space. Along the image of the line 1/Z is
    linear, so lambda_theta is the slope of 1/Z, and -lambda_rho is 1/Z at the foot of the
    perpendicular from the principal point.
    """
    for n in range(0, x.shape[0], 2):
        for b in range(x.shape[2]):
            x0, y0 = x[n, 0, b], x[n, 1, b]
            c, s, distance = line_normal(x0, y0, x[n + 1, 0, b], x[n + 1, 1, b])
            rho = x0 * c + y0 * s
            slope = (1.0 / Z[n + 1, b] - 1.0 / Z[n, b]) / distance
            foot = 1.0 / Z[n, b] - slope * (y0 * c - x0 * s)
            L[n, 0, b], L[n, 1, b], L[n, 2, b] = -foot * c, -foot * s, foot * rho
            L[n, 3, b], L[n, 4, b] = (1.0 + rho * rho) * s, -(1.0 + rho * rho) * c
            L[n, 5, b] = 0.0
            L[n + 1, 0, b], L[n + 1, 1, b], L[n + 1, 2, b] = slope * c, slope * s, -slope * rho
            L[n + 1, 3, b], L[n + 1, 4, b], L[n + 1, 5, b] = -rho * c, -rho * s, -1.0


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
    """Compute s and L of N / 2 segments, with angles near the goal's angles."""
    x, s, L = matrix(w, points, N, 2), vector(w, s, 2 * N), matrix(w, L, 2 * N, 6)
    segments(x, s)
    if goal >= 0:
        unwrap_angles(vector(w, goal, 2 * N), 4, s)
    points_interaction(x, vector(w, depth, N), L)
    to_segment_rates(x, L)


@stage
def lines_stage(w, step, N="count", points="N, 2", depth="N", goal="N or none", s="N", L="N, 6"):
    """Compute s and L of N / 2 straight lines, with angles near the goal's angles."""
    x, s = matrix(w, points, N, 2), vector(w, s, N)
    line_parameters(x, s)
    if goal >= 0:
        unwrap_angles(vector(w, goal, N), 2, s)
    lines_interaction(x, vector(w, depth, N), matrix(w, L, N, 6))


@stage
def intersections_stage(w, step, N="count", points="N, 2", s="k", L="k, 6", k="count"):
    """Compute s and L of N / 4 vanishing points, at infinite depth."""
    M = N // 4
    s = matrix(w, s, M, 2)
    intersections(matrix(w, points, N, 2), s)
    points_interaction(s, np.full((M, WIDTH), np.inf), matrix(w, L, 2 * M, 6))
