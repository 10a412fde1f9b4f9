"""Checks of the values that methods of a user's class return."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import CodeError, format_value


def check_returned_array(value: Any, who: str, wanted: tuple[int | str, ...]) -> Array:
    """Return a value as an array of the wanted shape; raise CodeError for any other value.

    A word in the shape stands for any size except 0. `who` is the method, as "Mine.command", or
    "Mine: a method" if the method is unknown.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise CodeError(
            f"{who} returned {format_value(value)} where numbers are needed; see robsim.testing"
        ) from None
    sizes = zip(wanted, array.shape, strict=False)
    fits = array.ndim == len(wanted) and array.size > 0
    if not fits or any(isinstance(n, int) and n != size for n, size in sizes):
        shape = f"({', '.join(map(str, wanted))})"
        raise CodeError(
            f"{who} returned shape {array.shape} where {shape} is needed; see robsim.testing"
        )
    return array
