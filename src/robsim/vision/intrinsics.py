"""The parts of a matrix K of intrinsics: focal lengths, principal point and skew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import ListOf, Number
from robsim.declare.context import Context, Raw
from robsim.declare.fields import is_identical
from robsim.vision.camera_checks import check_focal

PIXELS = Number(unit="px")
FOCAL_LENGTH = Number(above=0, unit="px")
MATRIX = ListOf(ListOf(PIXELS, 3, 3), 3, 3)
CENTER = ListOf(PIXELS, 2, 2, names=("cx", "cy"))
PART_INDICES = {"focal": ((0, 0), (1, 1)), "center": ((0, 2), (1, 2)), "skew": ((0, 1),)}


@dataclass(frozen=True)
class FocalLengths(ListOf):
    """The declaration of two focal lengths in pixels, or one number for both."""

    phrase: ClassVar[str] = "[fx, fy] in pixels, or one number for both"

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        single = isinstance(raw, int | float) and not isinstance(raw, bool)
        return super().read([raw, raw] if single else raw, c)

    def write(self, value: Any, c: Context) -> Any:
        fx, fy = value
        return fx if c.facts.get("brief") and is_identical(fx, fy) else [fx, fy]

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return super().controls(np.broadcast_to(value, 2).tolist(), place)

    def schema(self, define: Any) -> dict[str, Any]:
        return {"anyOf": [{"type": "number"}, super().schema(define)]}


FOCAL = FocalLengths(FOCAL_LENGTH, 2, 2, names=("fx", "fy"))


def get_intrinsic_part(K: Array, name: str) -> Any:
    """Return the part "focal", "center" or "skew" of K; one focal length if both are equal."""
    numbers = [K[place] for place in PART_INDICES[name]]
    if name == "skew" or (name == "focal" and numbers[0] == numbers[1]):
        return numbers[0]
    return np.array(numbers)


def replace_intrinsic_part(K: Array, name: str, new: Any) -> Array:
    """Return K (3, 3), or (3, 3, runs), with another part "focal", "center" or "skew"."""
    places = PART_INDICES[name]
    several = len(places) > 1 and np.ndim(new) > K.ndim - 2
    K_new = np.array(K)
    for place, number in zip(places, new if several else [new] * len(places), strict=True):
        K_new[place] = number
    if name == "focal":
        check_focal(np.min(K_new[0, 0]), np.min(K_new[1, 1]))
    return K_new


def build_intrinsics(
    focal: Sequence[float] | None,
    center: Sequence[float] | None,
    skew: float | None,
    size: Sequence[int] | None,
) -> list[list[float]]:
    """Return K from its parts; the default center is the middle of the image, the default skew 0.

    InputError is raised if the focal lengths are missing, or both the center and the size.
    """
    if focal is None:
        raise InputError(
            "focal is missing: give K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] "
            "or focal = [fx, fy], in pixels"
        )
    if center is None and size is None:
        raise InputError("center is missing: give center, or give size for the middle of the image")
    check_focal(*focal)
    (fx, fy), (cx, cy) = focal, center or image_center(size)
    return [[fx, skew or 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def image_center(size: Sequence[int] | None) -> list[float]:
    """Return the middle (column, row) of an image in pixels, empty without a size."""
    return [(n - 1) / 2 for n in size or ()]


def split_intrinsics(K: Array) -> dict[str, Any]:
    """Return the parts of K by their keys in a scenario file."""
    (fx, skew, cx), (_, fy, cy), _ = K.tolist()
    return {"focal": [fx, fy], "center": [cx, cy], "skew": skew}
