"""The declaration of an image's width and height."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import numbers
from robsim.base.errors import InputError
from robsim.declare import ListOf, Whole
from robsim.declare.spec import Spec

PIXELS = Whole(1, 1_000_000)


@dataclass(frozen=True)
class ImageSize(ListOf):
    """The declaration of an image's width and height in whole pixels."""

    item: Spec = PIXELS
    least: int = 2
    most: int = 2

    def check(self, value: Any, what: str) -> tuple[int, int]:
        pair = np.asarray(None if value is None else numbers(value, what, ()))
        if pair.shape != (2,) or (pair < 1).any() or (pair != np.round(pair)).any():
            raise InputError(f"{what} must be (width, height) in whole pixels, got {value!r}")
        return int(pair[0]), int(pair[1])

    def words(self) -> str:
        return "[width, height] in pixels"


SIZE = ImageSize()
