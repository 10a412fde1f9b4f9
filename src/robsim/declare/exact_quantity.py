"""Exact texts of quantities."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


class ExactQuantity(str):
    """The text of numbers in SI, such as '0.1, 0.2 m', with the numbers as an attribute."""

    numbers: tuple[float, ...]
    unit: str

    def __new__(cls, numbers: ArrayLike, unit: str) -> ExactQuantity:
        """Return the text of a number, or of several; the unit "1" is not written."""
        own = tuple(map(float, np.atleast_1d(numbers)))
        text = super().__new__(cls, f"{', '.join(map(repr, own))} {unit}".removesuffix(" 1"))
        text.numbers, text.unit = own, unit
        return text
