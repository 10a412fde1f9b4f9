"""Checks of the intrinsics and the distortion of a camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, check_known, format_value
from robsim.vision.lens_models import LENS_MODELS, LensModel, find_lens_model

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


def check_lens(name: object) -> LensModel:
    """Return the model of a lens by its name; raise InputError for an unknown name."""
    own = find_lens_model(name) if isinstance(name, str) else None
    if own not in (None, name):
        raise InputError(f"lens: the model {format_value(name)} has the name '{own}' here")
    check_known(name, LENS_MODELS, "lens: no model {}", "models")
    return LENS_MODELS[str(name)]


def check_distortion(coefficients: ArrayLike, model: LensModel) -> tuple[float, ...]:
    """Return the coefficients as a flat tuple, from a row, a column or a flat array of OpenCV.

    A fisheye lens without coefficients has four zeros.
    """
    array = as_floats(coefficients, "distortion", ())
    lens, most = array.ravel(), len(model.names)
    padded = ZERO_PADDED if most == 8 else ()
    if array.ndim not in (1, 2) or lens.size not in (*model.counts, *padded):
        raise InputError(
            f"distortion: expected {model.phrase}, flat, in a row or in a column, got shape "
            f"{array.shape}"
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
    if not lens.size and model.name == "fisheye":
        return (0.0,) * 4
    return tuple(lens[:8].tolist())
