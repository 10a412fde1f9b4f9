"""Tables of exact numbers, with each in the unit in which a person would write it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from robsim.base import si_units
from robsim.declare.fields import is_identical
from robsim.declare.quantities import DIMENSIONS, ExactQuantity

LESS = re.compile(r"\b0\.")  # how a number below one begins
WHOLE = 1e15  # up to which a number without a fraction may be said as a whole one


def shorten_numbers(raw: Any) -> Any:
    """Return tables in which each number has the unit that makes its text the shortest."""
    if isinstance(raw, Mapping):
        return {key: shorten_numbers(each) for key, each in raw.items()}
    if isinstance(raw, list):
        return [shorten_numbers(each) for each in raw]
    if isinstance(raw, ExactQuantity):
        return min(_yield_texts(raw.numbers, raw.unit), key=_rank_text)
    if isinstance(raw, float) and raw.is_integer() and abs(raw) < WHOLE:
        return raw if math.copysign(1.0, raw) < 0 and raw == 0 else int(raw)
    return raw


def _rank_text(text: str) -> tuple[int, int, int]:
    """Return by what one text of numbers is better than another: shorter, then whole."""
    return len(text), len(LESS.findall(text)), text.count(".")


def _yield_texts(numbers: tuple[float, ...], unit: str) -> Iterator[str]:
    """Yield texts that are read as these very numbers, the last in SI."""
    if unit in DIMENSIONS:
        dimension = DIMENSIONS[unit]
        for each in sorted(si_units.list_units(dimension), key="rad".__eq__):
            words = [_format_in_unit(x, each, dimension) for x in numbers]
            if None not in words:
                yield f"{', '.join(map(str, words))} {each}"
    yield f"{', '.join(map(_format_decimal, numbers))} {unit}".removesuffix(" 1")


def _format_in_unit(x: float, unit: str, dimension: si_units.Dimension) -> str | None:
    """Return the shortest number that is x in a unit; None where there is none."""
    ratio = x / si_units.get_unit_factor(unit, dimension)
    rounded = (round(ratio, digits) for digits in range(16))
    near = (math.nextafter(ratio, side) for side in (-math.inf, math.inf))
    for each in (*rounded, ratio, *near):
        word = _format_decimal(each)
        if is_identical(si_units.parse(f"{word} {unit}", dimension), x):
            return word
    return None


def _format_decimal(x: float) -> str:
    """Return a number without an exponent, where that is not longer."""
    exact = repr(float(x)).removesuffix(".0")
    return min(exact, format(Decimal(exact), "f"), key=len)
