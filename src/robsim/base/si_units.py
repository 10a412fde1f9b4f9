"""Quantities with units in texts. All values in Python are in metres, radians and seconds.

>>> 22.86 * cm, round(90 * deg, 6), (1, 2) * mm
(0.2286, 1.570796, (0.001, 0.002))
>>> parse("22.86 cm", "length"), parse("1, 2, 3 mm", "length", count=3)
(0.2286, (0.001, 0.002, 0.003))
"""

import math
import re
from decimal import Decimal, DecimalException
from typing import Any, Literal, overload

from robsim.base.decimal_comma import suggest_decimal_point
from robsim.base.errors import UnitError


class Unit(float):
    """A unit, as its factor to SI. Numbers, tuples and lists can be multiplied by it.

    >>> 5 * Unit(0.01), [1, 2] * Unit(0.001)
    (0.05, [0.001, 0.002])
    """

    def __rmul__(self, other: Any) -> Any:
        """Return a number, or a tuple or list of numbers, in SI."""
        if isinstance(other, tuple | list):
            return type(other)(each * self for each in other)
        return float.__rmul__(self, other)


m, cm, mm, um = Unit(1.0), Unit(1e-2), Unit(1e-3), Unit(1e-6)
rad, deg = Unit(1.0), Unit(math.pi / 180.0)
s, ms = Unit(1.0), Unit(1e-3)

Dimension = Literal[
    "length",
    "angle",
    "time",
    "speed",
    "turn rate",
    "acceleration",
    "turn acceleration",
    "mass",
    "density",
    "inertia",
]
# powers of ten are applied to decimal numbers, so that "22.86 cm" is the double nearest 0.2286
_UNITS: dict[str, dict[str, int | float]] = {
    "length": {"m": 0, "cm": -2, "mm": -3, "um": -6},
    "angle": {"rad": 0, "deg": deg},
    "time": {"s": 0, "ms": -3},
    "speed": {"m/s": 0, "cm/s": -2, "mm/s": -3},
    "turn rate": {"rad/s": 0, "deg/s": deg},
    "acceleration": {"m/s^2": 0, "cm/s^2": -2, "mm/s^2": -3},
    "turn acceleration": {"rad/s^2": 0, "deg/s^2": deg},
    "mass": {"kg": 0, "g": -3},
    "density": {"kg/m^3": 0, "g/cm^3": 3},
    "inertia": {"kg m^2": 0, "g cm^2": -7},
}
_QUANTITY = re.compile(r"([-+0-9.eE,\s]*)((?:k?g c?m|[a-zA-Zµ%/]*)(?:\^[23])?)\s*")


@overload
def parse(text: object, dimension: Dimension) -> float: ...
@overload
def parse(text: object, dimension: Dimension, count: int) -> tuple[float, ...]: ...
def parse(
    text: object, dimension: Dimension, count: int | None = None
) -> float | tuple[float, ...]:
    """Return a quantity such as "22.86 cm", or several such as "1, 2, 3 mm", in SI.

    Parameters
    ----------
    text : str
        Quantity with its unit.
    dimension : str
        Dimension, such as "length", "angle" or "time".
    count : int, optional
        Number of numbers in the text. Default: one, which is returned as a float.

    Returns
    -------
    float or tuple of float
        Numbers in SI units.

    Raises
    ------
    UnitError
        If the text has no unit, a unit of another dimension, a number that is not finite, or a
        wrong count of numbers.

    Examples
    --------
    >>> parse("22.86 cm", "length"), parse("1, 2, 3 mm", "length", count=3)
    (0.2286, (0.001, 0.002, 0.003))
    """
    if dimension not in _UNITS:
        raise UnitError(f"no dimension {dimension!r}; dimensions: {', '.join(_UNITS)}")
    units = _UNITS[dimension]
    match = _QUANTITY.fullmatch(text) if isinstance(text, str) and len(text) < 1000 else None
    if match is None or not match[1].strip() or match[2] not in units:
        raise UnitError(f"{text!r}: {_describe_expected(dimension, count, text)}")
    words = match[1].replace(",", " ").split()
    if len(words) != (count or 1):
        wrong = f"{text!r} has {len(words)} numbers, not {count or 1}"
        raise UnitError(f"{wrong}: {_describe_expected(dimension, count, text)}")
    try:
        numbers = tuple(scale_decimal(word, match[2], dimension) for word in words)
    except (DecimalException, OverflowError):
        raise UnitError(f"{text!r}: {_describe_expected(dimension, count, text)}") from None
    return numbers if count else numbers[0]


def _describe_expected(dimension: Dimension, count: int | None, text: object) -> str:
    """Return the end of a message about a text that is not a quantity of a dimension."""
    noun, example = ("a vector", "1, 2, 3") if count else ("one number", "1.5")
    listed, first = ", ".join(_UNITS[dimension]), next(iter(_UNITS[dimension]))
    expected = f'expected {noun} with a unit of {dimension} ({listed}), as in "{example} {first}"'
    return expected + suggest_decimal_point(text, count)


def list_units(dimension: Dimension) -> tuple[str, ...]:
    """Return the names of the units of a dimension.

    >>> list_units("time")
    ('s', 'ms')
    """
    return tuple(_UNITS[dimension])


def get_unit_factor(unit: object, dimension: Dimension) -> float:
    """Return the factor of a unit to SI; UnitError if it is not a unit of the dimension.

    >>> get_unit_factor("ms", "time")
    0.001
    """
    if not isinstance(unit, str) or unit not in _UNITS[dimension]:
        raise UnitError(
            f"{unit!r:.80}: expected a unit of {dimension}: {', '.join(_UNITS[dimension])}"
        )
    return parse(f"1 {unit}", dimension)


def make_quantity_pattern(dimension: Dimension) -> str:
    """Return a regular expression that matches quantities of a dimension, for editors.

    >>> make_quantity_pattern("angle")
    '^[-+0-9.eE,\\\\s]+(rad|deg)\\\\s*$'
    """
    units = "|".join(unit.replace("^", r"\^") for unit in _UNITS[dimension])
    return rf"^[-+0-9.eE,\s]+({units})\s*$"


def scale_decimal(word: str, unit: str, dimension: Dimension) -> float:
    """Return a decimal number with a unit in SI; OverflowError if it is not finite.

    >>> scale_decimal("22.86", "cm", "length")
    0.2286
    """
    number, factor = Decimal(word), _UNITS[dimension][unit]
    value = float(number.scaleb(factor)) if isinstance(factor, int) else float(number) * factor
    if not math.isfinite(value):
        raise OverflowError
    return value
