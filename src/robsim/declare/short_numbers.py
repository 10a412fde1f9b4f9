"""Exact numbers in texts, each in the unit that makes it short."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Any

from robsim.base import si_units
from robsim.declare.exact_quantity import ExactQuantity
from robsim.declare.fields import is_identical
from robsim.declare.quantities import DIMENSIONS

LESS = re.compile(r"\b0\.")  # the start of a number below one
LONG = re.compile(r"(?<![.\d])\d{4}")  # the start of a number of a thousand or more
SLACK = 3  # characters by which a number in a common unit may be longer
NEAR = 1e-14  # a number farther from the exact ratio, relative to it, is another double
WHOLE = 1e15  # integers below it are written without a decimal point


def shorten_numbers(raw: Any) -> Any:
    """Return tables with numbers in the units that make their texts the shortest.

    The lengths of a list have a common unit, and so have its angles.
    """
    if isinstance(raw, Mapping):
        return {key: shorten_numbers(each) for key, each in raw.items()}
    if isinstance(raw, list):
        exact = [each for each in raw if isinstance(each, ExactQuantity)]
        texts = {unit: _shorten_together(exact, unit) for unit in {each.unit for each in exact}}
        return [
            next(texts[each.unit]) if isinstance(each, ExactQuantity) else shorten_numbers(each)
            for each in raw
        ]
    if isinstance(raw, ExactQuantity):
        return next(_shorten_together([raw], raw.unit))
    if isinstance(raw, float) and raw.is_integer() and abs(raw) < WHOLE:
        return raw if math.copysign(1.0, raw) < 0 and raw == 0 else int(raw)
    return raw


def _shorten_together(quantities: list[ExactQuantity], unit: str) -> Iterator[str]:
    """Yield the shortest texts of the quantities with an SI unit, if possible in a common unit."""
    own = [dict(_yield_texts(each.numbers, unit)) for each in quantities if each.unit == unit]
    common = [each for each in own[0] if all(each in texts for texts in own)]
    best = min(common, key=lambda each: _rank_text("; ".join(texts[each] for texts in own)))
    alone = [min(texts.values(), key=_rank_text) for texts in own]
    together = [texts[best] for texts in own]
    is_short = len("".join(together)) <= len("".join(alone)) + SLACK * len(own)
    return iter(together if is_short else alone)


def _rank_text(text: str) -> tuple[int, int, int]:
    """Return a sort key: length and long numbers, then decimals below one, then decimal points."""
    return len(text) + 3 * len(LONG.findall(text)), len(LESS.findall(text)), text.count(".")


def _yield_texts(numbers: tuple[float, ...], unit: str) -> Iterator[tuple[str, str]]:
    """Yield units and the texts that are read as exactly these numbers, the last one in SI."""
    if dimension := DIMENSIONS.get(unit):
        for each in sorted(si_units.list_units(dimension), key="rad".__eq__):
            words = [_format_in_unit(x, each, dimension) for x in numbers]
            if None not in words:
                yield each, f"{', '.join(map(str, words))} {each}"
    yield unit, f"{', '.join(map(_format_decimal, numbers))} {unit}".removesuffix(" 1")


def _format_in_unit(x: float, unit: str, dimension: si_units.Dimension) -> str | None:
    """Return the shortest text of x in a unit; None if no text reproduces x exactly."""
    ratio = x / si_units.get_unit_factor(unit, dimension)
    rounded = (round(ratio, digits) for digits in range(16))
    near = (math.nextafter(ratio, side) for side in (-math.inf, math.inf))
    for each in dict.fromkeys((*rounded, ratio, *near)):
        if abs(each - ratio) <= NEAR * abs(ratio):
            word = _format_decimal(each)
            if is_identical(si_units.scale_decimal(word, unit, dimension), x):
                return word
    return None


def _format_decimal(x: float) -> str:
    """Return a number without an exponent, unless the exponent makes it shorter."""
    exact = repr(float(x)).removesuffix(".0")
    return min(exact, format(Decimal(exact), "f"), key=len)
