"""Features of the images of a circle (an ellipse) and of a sphere of known radius."""

import math

import numpy as np

from robsim.kernels.features.point_features import cross_columns
from robsim.kernels.formulas.image_moments import (
    ORDER_3,
    fit_inverse_depth_plane,
    mean_point,
    region_moment_rates,
)
from robsim.kernels.linear_algebra.pseudoinverse import least_squares
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import stage

RCOND = 1e-12  # with a smaller singular value the points do not determine a conic


@kernel
def _fit_conic(x, centre, size, q, rank):
    """Compute q[5, b] of the conic q . (u^2, u v, v^2, u, v) = 1 through x = centre + size (u, v).

    The mean of points of an ellipse is inside the ellipse, so the constant is never zero.
    """
    A, y = np.empty((x.shape[0], 5, x.shape[2])), np.ones((x.shape[0], x.shape[2]))
    mean_point(x, centre)
    size[:] = 0.0
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            u, v = x[n, 0, b] - centre[0, b], x[n, 1, b] - centre[1, b]
            size[b] += (u * u + v * v) / x.shape[0]
    for b in range(x.shape[2]):
        size[b] = math.sqrt(size[b])
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            u, v = (x[n, 0, b] - centre[0, b]) / size[b], (x[n, 1, b] - centre[1, b]) / size[b]
            A[n, 0, b], A[n, 1, b], A[n, 2, b] = u * u, u * v, v * v
            A[n, 3, b], A[n, 4, b] = u, v
    least_squares(A, y, 0.0, RCOND, q, rank)


@kernel
def fit_ellipse(x, centre, mu):
    """Compute centre[2, b] and area moments mu[k, b] of the ellipse through x[n, 2, b].

    The ellipse (z - z0)' S (z - z0) = k has n = mu / area = k S^-1 / 4. Its odd moments are zero.
    Its even moments above order 2 are not computed and set to zero. The results are NaN if the
    conic is not an ellipse.
    """
    runs = x.shape[2]
    size, q, rank = np.empty(runs), np.empty((5, runs)), np.empty(runs, np.int64)
    _fit_conic(x, centre, size, q, rank)
    mu[:] = 0.0
    for b in range(runs):
        a, h, c, d, e = q[0, b], 0.5 * q[1, b], q[2, b], q[3, b], q[4, b]
        det = a * c - h * h
        u, v = 0.5 * (h * e - c * d) / det, 0.5 * (h * d - a * e) / det
        scale = 0.25 * (1.0 + a * u * u + 2.0 * h * u * v + c * v * v) / det * size[b] ** 2
        good = det > 0.0 and scale * a > 0.0 and rank[b] == 5
        one = 1.0 if good else math.nan
        scale *= one
        centre[0, b] += one * size[b] * u
        centre[1, b] += one * size[b] * v
        mu[0, b], mu[3, b], mu[4, b], mu[5, b] = one, scale * c, -scale * h, scale * a


@kernel
def ellipse_rates(mu, R, L):
    """Compute L[5, 6, b] of (xg, yg, n20, n11, n02), n = mu / mu00, from the rates R[6, 6, b]."""
    for c in range(6):
        for b in range(mu.shape[1]):
            L[0, c, b], L[1, c, b] = R[1, c, b], R[2, c, b]
            for k in range(3, 6):
                L[k - 1, c, b] = (R[k, c, b] - mu[k, b] / mu[0, b] * R[0, c, b]) / mu[0, b]


@kernel
def sphere_coordinates(x, Z, radius, s):
    """Compute s[3, b] = (X, Y, Z) / radius of the centre x[2, b] at depth Z[b]."""
    for b in range(x.shape[1]):
        far = Z[b] / radius[b]
        s[0, b], s[1, b], s[2, b] = x[0, b] * far, x[1, b] * far, far


@kernel
def sphere_interaction(s, radius, L):
    """Compute L[3, 6, b] = [-I / radius, [s]x]: Fomena and Chaumette (2009), IEEE T-RO 25(4)."""
    for r in range(3):
        for c in range(3):
            for b in range(s.shape[1]):
                L[r, c, b] = -1.0 / radius[b] if c == r else 0.0
    cross_columns(s, L)


@stage
def ellipse_stage(
    w,
    step,
    N="count",
    points="N, 2",
    depth="N",
    centre="2",
    mu="10",
    ABC="3",
    R="6, 6",
    s="5",
    L="5, 6",
):
    """Compute s = (xg, yg, n20, n11, n02) and L of an ellipse through N image points."""
    centre, mu, ABC = vector(w, centre, 2), vector(w, mu, ORDER_3), vector(w, ABC, 3)
    x, R, s = matrix(w, points, N, 2), matrix(w, R, 6, 6), vector(w, s, 5)
    fit_ellipse(x, centre, mu)
    for b in range(WIDTH):
        s[0, b], s[1, b] = centre[0, b], centre[1, b]
        s[2, b], s[3, b], s[4, b] = mu[3, b], mu[4, b], mu[5, b]
    fit_inverse_depth_plane(x, vector(w, depth, N), ABC)
    region_moment_rates(ABC, centre, mu, R)
    ellipse_rates(mu, R, matrix(w, L, 5, 6))


@stage
def sphere_stage(w, step, point="1, 2", depth="1", radius="row", s="3", L="3, 6"):
    """Compute s and L of a sphere from the image point and the depth of its centre."""
    x, Z, radius = vector(w, point, 2), vector(w, depth, 1)[0], vector(w, radius, 1)[0]
    s = vector(w, s, 3)
    sphere_coordinates(x, Z, radius, s)
    sphere_interaction(s, radius, matrix(w, L, 3, 6))
