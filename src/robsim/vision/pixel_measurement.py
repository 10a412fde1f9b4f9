"""Measured pixels, some of them missing, and their normalised coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_positive, move_runs_first, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.kernels.formulas import perspective as kernels
from robsim.vision.camera import Camera

LARGEST = 1e100  # metres or pixels: its square must be finite


def check_measured_pixels(
    pixels: ArrayLike, what: str, camera: object, count: int | str = "N"
) -> Array:
    """Return checked pixels (..., count, 2) of a camera, NaN for marks that are not seen."""
    if not isinstance(camera, Camera):
        raise InputError(f"{what}: expected the Camera of the image, got {format_value(camera)}")
    return as_floats(pixels, what, (count, 2), gaps=True)


def check_noise(noise: float) -> float:
    """Return a checked standard deviation of a pixel coordinate."""
    sigma = as_positive(noise, "noise")
    if sigma > LARGEST:
        raise InputError(f"noise: expected pixels, at most {LARGEST:g}, got {sigma:g}")
    return sigma


def normalise_pixels(pixels: Array, camera: Camera) -> Array:
    """Return the normalised points (..., N, 2) of pixels (..., N, 2), or NaN."""
    return move_runs_first(camera.points_of(move_runs_last(pixels, 2)), pixels.shape[:-2])


def pixel_rate_matrices(x: Array, camera: Camera) -> Array:
    """Return the derivatives (..., N, 2, 2) of pixels by normalised points x (..., N, 2)."""
    last = move_runs_last(x, 2)
    J = np.empty((len(last), 2, 2, last.shape[-1]))
    kernels.pixel_jacobian(last, camera.K, camera.lens_kind, camera.coefficients, J)
    return move_runs_first(J, x.shape[:-2])
