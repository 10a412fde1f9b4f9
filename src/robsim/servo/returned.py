"""What a method returned that may be the user's own."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError


def returned(value: Any, who: str, wanted: tuple[int | str, ...]) -> Array:
    """Numbers of the wanted shape (a word stands for any size but 0), or an InputError.

    `who` is "Mine.command", or "Mine: a method" where it is not known which.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{who} returned {value!r:.80} where numbers are needed; see robsim.testing"
        ) from None
    sizes = zip(wanted, array.shape, strict=False)
    fits = array.ndim == len(wanted) and array.size > 0
    if not fits or any(isinstance(n, int) and n != size for n, size in sizes):
        shape = f"({', '.join(map(str, wanted))})"
        raise InputError(
            f"{who} returned shape {array.shape} where {shape} is needed; see robsim.testing"
        )
    return array
