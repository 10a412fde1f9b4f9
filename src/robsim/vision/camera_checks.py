"""Checks of the intrinsics and the distortion of a camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError

COUNTS = 0, 4, 5, 8  # supported numbers of coefficients
ZERO_PADDED = 12, 14  # with further coefficients of a thin prism, and of a tilted sensor


def check_focal(fx: float, fy: float) -> None:
    """Raise InputError for focal lengths below a pixel, which are probably in metres."""
    least = min(fx, fy)
    if least < 1.0:
        raise InputError(
            f"a focal length of {least:g} pixels: is it in metres? In pixels it is the length "
            f"divided by the size of a pixel: {least:g} / 1e-5 = {least / 1e-5:g} for pixels of "
            "10 micrometres"
        )


def check_intrinsics(matrix: ArrayLike) -> Array:
    """Return K (3, 3) as an array; raise InputError unless it is a matrix of intrinsics."""
    K = as_floats(matrix, "K", (3, 3))
    if K.ndim != 2 or K[1, 0] != 0 or not np.array_equal(K[2], (0, 0, 1)):
        raise InputError(f"K must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], got {K.tolist()}")
    if not (K[0, 0] > 0 and K[1, 1] > 0):
        raise InputError(f"K: focal lengths must be above zero, got {K[0, 0]} and {K[1, 1]} px")
    return K


def check_distortion(coefficients: ArrayLike) -> tuple[float, ...]:
    """Return the coefficients as a flat tuple, from a row, a column or a flat array of OpenCV."""
    array = as_floats(coefficients, "distortion", ())
    lens = array.ravel()
    if array.ndim not in (1, 2) or lens.size not in (*COUNTS, *ZERO_PADDED):
        raise InputError(
            "distortion: expected 0, 4 (k1 k2 p1 p2), 5 (.. k3) or 8 (.. k4 k5 k6) numbers, flat, "
            f"in a row or in a column, got shape {array.shape}"
        )
    if array.ndim == 2 and 1 not in array.shape and lens.size:
        raise InputError(f"distortion: expected one row or column, got shape {array.shape}")
    if lens[8:].any():
        raise InputError(
            "distortion: thin prisms and tilted sensors (s1 s2 s3 s4 tau_x tau_y, from the ninth "
            f"on) are not supported: these coefficients must be zero, got {lens[8:].tolist()}"
        )
    if (np.abs(lens) > 1e6).any():
        raise InputError(f"distortion: coefficients are at most 1e6, got {lens.tolist()}")
    return tuple(lens[:8].tolist())
