"""The families of tags, and their patterns of black and white cells."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import frozen
from robsim.base.errors import InputError, check_known


class Family(NamedTuple):
    """A family of tags: cells on a side with the black border, number of tags, OpenCV's name."""

    cells: int
    ids: int
    dictionary: str
    april: bool = False  # whether AprilTag finds it; OpenCV draws these turned by half a turn


FAMILIES = {
    "tag16h5": Family(6, 30, "DICT_APRILTAG_16h5", True),
    "tag25h9": Family(7, 35, "DICT_APRILTAG_25h9", True),
    "tag36h11": Family(8, 587, "DICT_APRILTAG_36h11", True),
    **{
        f"DICT_{bits}X{bits}_{count}": Family(bits + 2, count, f"DICT_{bits}X{bits}_{count}")
        for bits in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
    "DICT_ARUCO_ORIGINAL": Family(7, 1024, "DICT_ARUCO_ORIGINAL"),
}


def family(name: Any) -> Family:
    """Return the family of a name, AprilTag's or OpenCV's; InputError: there is none.

    >>> family("tag36h11").ids
    587
    """
    check_known(name, FAMILIES, "no family {} of tags", "families")
    return FAMILIES[name]


def opencv(what: str = "tags need") -> Any:
    """Return OpenCV; InputError says what needs it: it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError(f"{what} OpenCV: pip install 'robsim[vision]'") from None
    return cv2


def dictionary(name: str) -> Any:
    """Return a family as OpenCV has it."""
    aruco = opencv().aruco
    return aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[name].dictionary))


@lru_cache(256)
def black(name: str, number: int) -> NDArray[np.bool_]:
    """Return which cells (n, n) of a tag with its border are black, as OpenCV draws it."""
    picture = opencv().aruco.generateImageMarker(dictionary(name), number, FAMILIES[name].cells)
    return frozen(np.asarray(picture) == 0)
