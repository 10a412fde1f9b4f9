"""Reasons of refused values, in the units and with the digits that pages show."""

from __future__ import annotations

import math
import re

from robsim.declare.tables import LACKING

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LISTED = rf"{_NUMBER.pattern}(?:\s*(?:,|to|and)\s*{_NUMBER.pattern})*"  # several numbers
_ANGLES = re.compile(rf"(\[{_LISTED}\]|(?<![\w.]){_LISTED})('?\s)(rad(?:/s(?:\^2)?)?)(?![\w/])")
_QUOTED = re.compile(rf"'({_LISTED} [\w/^]+)'")  # a quantity as a text of a file
_WHOLE = re.compile(r"(?<![\w.])[-+]?\d+\.0(?![\d\w])")
_BOUND = re.compile(rf"(?:(?<= than )|(?<= to )){_NUMBER.pattern}(?=, got )")
_GOT = re.compile(rf", got {_NUMBER.pattern}$", re.MULTILINE)
_SHOWN = {"per second": "1/s", "1": ""}  # units of pages for units of declarations


def format_refusal(text: str, unit: str = "") -> str:
    """Return the reason of a refused value, with the unit of the value.

    >>> format_refusal("must be greater than 0, got -1.0", "per second")
    'must be greater than 0, got -1 1/s'
    >>> format_refusal("must be less than 0.5, got '2.0 rad'", "rad")
    'must be less than 28.65 deg, got 114.6 deg'
    """
    lines = text.split("\n")
    first = [line for line in lines if not line.endswith(LACKING)]  # others are consequences
    text = _QUOTED.sub(r"\1", "\n".join(first or lines))
    if unit := _SHOWN.get(unit, unit):
        text = _GOT.sub(rf"\g<0> {unit}", text)
        text = _BOUND.sub(lambda each: each[0] if each[0] == "0" else f"{each[0]} {unit}", text)
    return _WHOLE.sub(lambda each: f"{float(each[0]):g}", convert_radians(text))


def convert_radians(text: str) -> str:
    """Return a message with its angles in degrees, as pages show them.

    >>> convert_radians("'link1' is 9 rad, outside its limits [-2.8973, 2.8973] rad")
    "'link1' is 515.7 deg, outside its limits [-166, 166] deg"
    """
    return _ANGLES.sub(_convert_angles, text)


def _convert_angles(match: re.Match[str]) -> str:
    numbers, quote, unit = match.groups()
    degrees = _NUMBER.sub(lambda each: f"{math.degrees(float(each[0])):.4g}", numbers)
    return f"{degrees}{quote}{unit.replace('rad', 'deg', 1)}"
