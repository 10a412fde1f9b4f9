"""The intrinsics of a scaled or cropped image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array, as_bool, as_integer
from robsim.base.errors import InputError, format_value
from robsim.vision.image_size import SIZE

PixelSize = tuple[int, int]
LARGEST = 1_000_000  # pixels of a side


def scale_intrinsics(
    K: Array, size: PixelSize | None, new_size: Sequence[int], stretch: bool
) -> tuple[Array, PixelSize]:
    """Return K and the size of the image scaled to another size."""
    new, old = _check_new_size(new_size), _require_size(size, "resized")
    scale = np.array(new) / old
    if not as_bool(stretch, "stretch") and abs(scale[0] - scale[1]) * max(old) >= 1:
        raise InputError(
            f"{old[0]} x {old[1]} pixels resized to {new[0]} x {new[1]} changes the aspect "
            "ratio: crop the camera first (`cropped`), or give stretch=True"
        )
    K_new = K.copy()
    K_new[:2] *= scale[:, None]
    K_new[:2, 2] += (scale - 1) / 2  # u' + 0.5 = (u + 0.5) scale
    return K_new, new


def crop_intrinsics(
    K: Array, size: PixelSize | None, left: int, top: int, new_size: Sequence[int]
) -> tuple[Array, PixelSize]:
    """Return K and the size of the part of an image that begins at the pixel (left, top)."""
    new, old = _check_new_size(new_size), _require_size(size, "cropped")
    corner = np.array([as_integer(left, "left", 0, LARGEST), as_integer(top, "top", 0, LARGEST)])
    if (corner + new > old).any():
        raise InputError(
            f"{new[0]} x {new[1]} pixels from ({left}, {top}) on exceed the image of "
            f"{old[0]} x {old[1]}"
        )
    K_new = K.copy()
    K_new[:2, 2] -= corner
    return K_new, new


def _check_new_size(value: Sequence[int]) -> PixelSize:
    """Return a checked size (width, height) in whole pixels."""
    size = SIZE.check(value, "size")
    if max(size) > LARGEST:
        raise InputError(f"size must be at most {LARGEST} pixels, got {format_value(value)}")
    return size


def _require_size(size: PixelSize | None, doing: str) -> PixelSize:
    """Return the size of a camera; raise InputError if it has none."""
    if size is None:
        raise InputError(f"a camera without a size cannot be {doing}: give it size=(width, height)")
    return size
