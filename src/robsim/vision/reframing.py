"""The intrinsics of an image that was scaled or cut."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array, flag, whole
from robsim.base.errors import InputError, said
from robsim.vision.image_size import SIZE

Size = tuple[int, int]
LARGEST = 1_000_000  # pixels of a side


def scaled(K: Array, size: Size | None, given: Any, stretch: bool) -> tuple[Array, Size]:
    """Return K and the size of the whole image scaled to another size."""
    new, old = _checked(given), _known(size, "resized")
    scale = np.array(new) / old
    if not flag(stretch, "stretch") and abs(scale[0] - scale[1]) * max(old) >= 1:
        raise InputError(
            f"{old[0]} x {old[1]} pixels resized to {new[0]} x {new[1]} changes the shape: "
            "crop it before (`cropped`), or say stretch=True"
        )
    found = K.copy()
    found[:2] *= scale[:, None]
    found[:2, 2] += (scale - 1) / 2  # u' + 0.5 = (u + 0.5) scale
    return found, new


def cut(K: Array, size: Size | None, left: int, top: int, given: Any) -> tuple[Array, Size]:
    """Return K and the size of the part of an image that begins at the pixel (left, top)."""
    new, old = _checked(given), _known(size, "cropped")
    corner = np.array([whole(left, "left", 0, LARGEST), whole(top, "top", 0, LARGEST)])
    if (corner + new > old).any():
        raise InputError(
            f"{new[0]} x {new[1]} pixels from ({left}, {top}) on leave an image of "
            f"{old[0]} x {old[1]}"
        )
    found = K.copy()
    found[:2, 2] -= corner
    return found, new


def _checked(given: Any) -> Size:
    """Return a size in whole pixels that an image can have."""
    size = SIZE.check(given, "size")
    if max(size) > LARGEST:
        raise InputError(f"size must be at most {LARGEST} pixels, got {said(given)}")
    return size


def _known(size: Size | None, doing: str) -> Size:
    """Return the size of a camera; InputError if it has none."""
    if size is None:
        raise InputError(f"a camera without a size cannot be {doing}: give it size=(width, height)")
    return size
