"""The rates of pixels with the numbers of a lens."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.vision.camera import Camera


def lens_rates(x: Array, pixels: Array, camera: Camera, coefficients: int) -> Array:
    """Return the rates (..., 2, 4 + n) of pixels with fx, fy, cx, cy and n coefficients.

    Of normalised points x (..., 2) with their pixels (..., 2); the coefficients are in the order of
    OpenCV, k1 k2 p1 p2 k3 k4 k5 k6 (`robsim.kernels.formulas.camera.distort`).
    """
    (fx, skew, cx), (_, fy, cy), _ = camera.K
    y_bent = (pixels[..., 1] - cy) / fy
    x_bent = (pixels[..., 0] - cx - skew * y_bent) / fx
    zero, one = np.zeros_like(x_bent), np.ones_like(x_bent)
    column = [x_bent, zero, one, zero]
    row = [zero, y_bent, zero, one]
    for dx, dy in _bends(x, camera.lens)[:coefficients]:
        column.append(fx * dx + skew * dy)
        row.append(fy * dy)
    return np.stack([np.stack(column, -1), np.stack(row, -1)], -2)


def _bends(x: Array, lens: Array) -> list[tuple[Array, Array]]:
    """Return the rates of both coordinates of the distorted point with each coefficient."""
    k1, k2, _, _, k3, k4, k5, k6 = lens
    x, y = x[..., 0], x[..., 1]
    r2 = x * x + y * y
    under = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    f = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / under
    radial = [r2**n / under for n in (1, 2, 3)]
    k1_2, k3_ = radial[:2], radial[2:]
    k4_6 = [-f * each for each in radial]
    tangential = [(2 * x * y, r2 + 2 * y * y), (r2 + 2 * x * x, 2 * x * y)]
    along = [(x * each, y * each) for each in (*k1_2, *k3_, *k4_6)]
    return [*along[:2], *tangential, *along[2:]]
