"""Tables of exact numbers, with each in the unit in which a person would write it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from robsim.base import units
from robsim.declare.fields import same
from robsim.declare.quantities import DIMENSIONS, Exact

LESS = re.compile(r"\b0\.")  # how a number below one begins
WHOLE = 1e15  # up to which a number without a fraction may be said as a whole one


def shortest(raw: Any) -> Any:
    """Return tables in which each number has the unit that makes its text the shortest."""
    if isinstance(raw, Mapping):
        return {key: shortest(each) for key, each in raw.items()}
    if isinstance(raw, list):
        return [shortest(each) for each in raw]
    if isinstance(raw, Exact):
        return min(_texts(raw.numbers, raw.unit), key=_plainness)
    if isinstance(raw, float) and raw.is_integer() and abs(raw) < WHOLE:
        return raw if math.copysign(1.0, raw) < 0 and raw == 0 else int(raw)
    return raw


def _plainness(text: str) -> tuple[int, int, int]:
    """Return by what one text of numbers is better than another: shorter, then whole."""
    return len(text), len(LESS.findall(text)), text.count(".")


def _texts(numbers: tuple[float, ...], unit: str) -> Iterator[str]:
    """Yield texts that are read as these very numbers, the last in SI."""
    if unit in DIMENSIONS:
        dimension = DIMENSIONS[unit]
        for each in sorted(units.names(dimension), key="rad".__eq__):
            words = [_in_unit(x, each, dimension) for x in numbers]
            if None not in words:
                yield f"{', '.join(map(str, words))} {each}"
    yield f"{', '.join(map(_plain, numbers))} {unit}".removesuffix(" 1")


def _in_unit(x: float, unit: str, dimension: units.Dimension) -> str | None:
    """Return the shortest number that is x in a unit; None where there is none."""
    ratio = x / units.factor(unit, dimension)
    rounded = (round(ratio, digits) for digits in range(16))
    near = (math.nextafter(ratio, side) for side in (-math.inf, math.inf))
    for each in (*rounded, ratio, *near):
        word = _plain(each)
        if same(units.parse(f"{word} {unit}", dimension), x):
            return word
    return None


def _plain(x: float) -> str:
    """Return a number without an exponent, where that is not longer."""
    exact = repr(float(x)).removesuffix(".0")
    return min(exact, format(Decimal(exact), "f"), key=len)
