"""Camera axes, perspective, radial-tangential distortion, visibility.

In camera axes x points to the right (columns), y down (rows) and z along the optical axis. `lens`
holds (k1, k2, p1, p2, k3, k4, k5, k6) in the order of OpenCV. All coefficients of a pinhole camera
are zero. Fisheye lenses are in `robsim.kernels.formulas.fisheye`.
"""

import numpy as np

from robsim.kernels.formulas.fisheye import distort_fisheye_jacobian
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, any_lane, where

LEAST_DEPTH = 1e-9  # metres; a point with less depth is behind the camera
IN_IMAGE, OUT_OF_IMAGE, BEHIND_CAMERA = 0, 1, 2
UNDETECTED = 3  # status of an image in which a detector does not find a mark
NO_GRADIENT, NOTHING_IN_VIEW = 4, 5  # status of a picture that determines no motion
NO_LENS, BROWN, FISHEYE = 0, 1, 2  # kinds of lenses: no distortion, radial-tangential, fisheye


@part
def distort(x, y, lens):
    """Return the distorted normalised point of (x, y), by Brown's model with a rational factor.

    x' = x f + 2 p1 x y + p2 (r2 + 2 x2), y' = y f + p1 (r2 + 2 y2) + 2 p2 x y, with
    f = (1 + k1 r2 + k2 r4 + k3 r6) / (1 + k4 r2 + k5 r4 + k6 r6).
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = lens
    r2 = x * x + y * y
    f = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return (
        x * f + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * f + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


@part
def distort_jacobian(x, y, lens):
    """Return (dx'/dx, dx'/dy, dy'/dy) of `distort`; dy'/dx equals dx'/dy."""
    k1, k2, p1, p2, k3, k4, k5, k6 = lens
    r2 = x * x + y * y
    over, under = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    f = over / under
    df = (
        (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)) - f * (k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6))
    ) / under
    return (
        f + 2.0 * x * x * df + 2.0 * p1 * y + 6.0 * p2 * x,
        2.0 * x * y * df + 2.0 * p1 * x + 2.0 * p2 * y,
        f + 2.0 * y * y * df + 6.0 * p1 * y + 2.0 * p2 * x,
    )


@part
def undistort(u, v, lens):
    """Return the points that `distort` maps to (u, v), by Newton's method on lanes, or NaN.

    A lane that has converged, or is NaN, stays unchanged while other lanes are still updated.
    """
    x, y = u, v
    moving = absolute(u) + absolute(v) >= 0.0  # false for NaN
    for _ in range(50):
        du, dv = distort(x, y, lens)
        xx, xy, yy = distort_jacobian(x, y, lens)
        du, dv, det = du - u, dv - v, xx * yy - xy * xy
        dx, dy = (yy * du - xy * dv) / det, (xx * dv - xy * du) / det
        x, y = where(moving, x - dx, x), where(moving, y - dy, y)
        size = absolute(dx) + absolute(dy)
        moving = moving & (size > 1e-15 * (1.0 + absolute(x) + absolute(y)))
        if not any_lane(moving):
            return x, y
    du, dv = distort(x, y, lens)  # rounding may keep the last step above the threshold
    good = absolute(du - u) + absolute(dv - v) <= 1e-13 * (1.0 + absolute(u) + absolute(v))
    lost = moving & ~good
    return where(lost, np.nan, x), where(lost, np.nan, y)


@part
def pinhole_pixel(x, y, fu, skew, u0, fv, v0):
    """Return the pixel (column, row) of a normalised image point."""
    return fu * x + skew * y + u0, fv * y + v0


@entry("float64[:, :, ::1], float64[:, ::1], int64, float64[::1], out float64[:, :, :, ::1]")
def pixel_jacobian(x, K, kind, lens, J):
    """Compute J[n, 2, 2, b], the Jacobian of the pixel by the normalised point at x[n, 2, b].

    `kind` is the kind of the lens, and `lens` holds its coefficients.
    """
    k = (lens[0], lens[1], lens[2], lens[3], lens[4], lens[5], lens[6], lens[7])
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            if kind == FISHEYE:
                xx, xy, yy = distort_fisheye_jacobian(x[n, 0, b], x[n, 1, b], k)
            else:
                xx, xy, yy = distort_jacobian(x[n, 0, b], x[n, 1, b], k)
            J[n, 0, 0, b], J[n, 0, 1, b] = K[0, 0] * xx + K[0, 1] * xy, K[0, 0] * xy + K[0, 1] * yy
            J[n, 1, 0, b], J[n, 1, 1, b] = K[1, 1] * xy, K[1, 1] * yy


@entry("float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], out float64[:, :, ::1]")
def transform_image_points(x, Z, T, X):
    """Compute X[n, 3, b] = T p with p = Z (x, 1) for points x[n, 2, b] at depths Z[n, b]."""
    for n in range(X.shape[0]):
        for r in range(3):
            for b in range(X.shape[2]):
                X[n, r, b] = (T[r, 0, b] * x[n, 0, b] + T[r, 1, b] * x[n, 1, b] + T[r, 2, b]) * Z[
                    n, b
                ] + T[r, 3, b]
