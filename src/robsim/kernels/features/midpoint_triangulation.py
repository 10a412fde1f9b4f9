"""Triangulation of points in space from two images."""

import numpy as np

from robsim.kernels.features.point_features import points_3d_interaction
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.stages import stage

PARALLEL_SINE = 1e-30  # largest squared sine of the angle between parallel rays


@part
def _cross_components(ax, ay, az, bx, by, bz):
    """Return the cross product a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@entry("float64[:, :, ::1], float64[:, :, ::1], float64[:, :, ::1], out float64[:, :, ::1]")
def triangulate_midpoint(x, other, between, X):
    """Compute X[n, 3, b] in the first camera from normalised points x[n, 2, b] and other[n, 2, b].

    between[3, 4, b] = (R, t) is the pose of the second camera in the first. X is the midpoint of
    the common perpendicular of the rays l d and t + m e, with d = (x, 1), e = R (other, 1):
    l = (t x e).(d x e) / |d x e|^2, m = (t x d).(d x e) / |d x e|^2 (Hartley and Sturm 1997, the
    mid-point method). The result is exact for exact images, and NaN for parallel rays.
    """
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            d0, d1, d2 = x[n, 0, b], x[n, 1, b], 1.0
            u, v = other[n, 0, b], other[n, 1, b]
            e0 = between[0, 0, b] * u + between[0, 1, b] * v + between[0, 2, b]
            e1 = between[1, 0, b] * u + between[1, 1, b] * v + between[1, 2, b]
            e2 = between[2, 0, b] * u + between[2, 1, b] * v + between[2, 2, b]
            t0, t1, t2 = between[0, 3, b], between[1, 3, b], between[2, 3, b]
            c0, c1, c2 = _cross_components(d0, d1, d2, e0, e1, e2)
            f0, f1, f2 = _cross_components(t0, t1, t2, e0, e1, e2)
            g0, g1, g2 = _cross_components(t0, t1, t2, d0, d1, d2)
            square = c0 * c0 + c1 * c1 + c2 * c2
            lengths = (d0 * d0 + d1 * d1 + d2 * d2) * (e0 * e0 + e1 * e1 + e2 * e2)
            half = 0.5 / square if square > PARALLEL_SINE * lengths else np.nan
            l = half * (f0 * c0 + f1 * c1 + f2 * c2)
            m = half * (g0 * c0 + g1 * c1 + g2 * c2)
            X[n, 0, b] = l * d0 + (0.5 * t0 + m * e0)
            X[n, 1, b] = l * d1 + (0.5 * t1 + m * e1)
            X[n, 2, b] = l * d2 + (0.5 * t2 + m * e2)


@stage
def stereo_stage(w, step, N="count", points="N, 2", others="N, 2", T="3, 4", s="3*N", L="3*N, 6"):
    """Compute s and L of points triangulated from two cameras.

    T is the pose of the second camera in the first camera.
    """
    X, between = matrix(w, s, N, 3), matrix(w, T, 3, 4)
    triangulate_midpoint(matrix(w, points, N, 2), matrix(w, others, N, 2), between, X)
    points_3d_interaction(vector(w, s, 3 * N), matrix(w, L, 3 * N, 6))
