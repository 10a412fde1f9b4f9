"""The families of tags, and their patterns of black and white cells."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import make_read_only
from robsim.base.errors import InputError, check_known
from robsim.declare import Word


class TagFamily(NamedTuple):
    """A family of tags, and its dictionary in OpenCV."""

    cells: int  # on a side, with the black border
    ids: int  # number of tags
    dictionary: str  # name in OpenCV
    april: bool = False  # whether AprilTag detects the tags, which OpenCV draws upside down


TAG_FAMILIES = {
    "tag16h5": TagFamily(6, 30, "DICT_APRILTAG_16h5", True),
    "tag25h9": TagFamily(7, 35, "DICT_APRILTAG_25h9", True),
    "tag36h11": TagFamily(8, 587, "DICT_APRILTAG_36h11", True),
    **{
        f"DICT_{bits}X{bits}_{count}": TagFamily(bits + 2, count, f"DICT_{bits}X{bits}_{count}")
        for bits in (4, 5, 6, 7)
        for count in (50, 100, 250, 1000)
    },
    "DICT_ARUCO_ORIGINAL": TagFamily(7, 1024, "DICT_ARUCO_ORIGINAL"),
}
FAMILY = Word(tuple(TAG_FAMILIES), "family")


def find_tag_family(name: str) -> TagFamily:
    """Return the family with a name of AprilTag or OpenCV; raise InputError if there is none.

    >>> find_tag_family("tag36h11").ids
    587
    """
    check_known(name, TAG_FAMILIES, "no family {} of tags", "families")
    return TAG_FAMILIES[name]


def import_opencv(what: str = "tags need") -> Any:
    """Return OpenCV; raise InputError with the subject `what` if it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError(f"{what} OpenCV: pip install 'robsim[vision]'") from None
    return cv2


def opencv_dictionary(name: str) -> Any:
    """Return a family as a dictionary of OpenCV."""
    aruco = import_opencv().aruco
    return aruco.getPredefinedDictionary(getattr(aruco, TAG_FAMILIES[name].dictionary))


@lru_cache(256)
def black_cells(name: str, number: int) -> NDArray[np.bool_]:
    """Return whether the cells (n, n) of a tag with its border are black, as OpenCV draws it."""
    picture = import_opencv().aruco.generateImageMarker(
        opencv_dictionary(name), number, TAG_FAMILIES[name].cells
    )
    return make_read_only(np.asarray(picture) == 0)
