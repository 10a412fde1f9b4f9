"""Tables as text, made of columns."""

from __future__ import annotations

import math
from collections.abc import Sequence


def aligned(columns: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table; the first two columns flush left, the others flush right.

    >>> aligned([["a", "bc"], ["d", "e"], ["1", "10"]])
    ['a   d   1', 'bc  e  10']
    """
    widths = [max(map(len, column)) for column in columns]
    padded = [
        [text.ljust(width) if i < 2 else text.rjust(width) for text in column]
        for i, (column, width) in enumerate(zip(columns, widths, strict=True))
    ]
    return ["  ".join(row).rstrip() for row in zip(*padded, strict=True)]


def digits(value: float) -> str:
    """Return a number to three digits; "-" for NaN, and "0" for rounding errors.

    >>> digits(0.12345), digits(4321.0), digits(1e-12)
    ('0.123', '4321', '0')
    """
    if math.isnan(value):
        return "-"
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.0f}" if 100 <= abs(value) < 1e5 else f"{value:.3g}"
