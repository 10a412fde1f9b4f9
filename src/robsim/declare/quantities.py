"""Numbers with units in texts, in SI units in Python."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypedDict, Unpack, get_args

import numpy as np

from robsim.base import si_units
from robsim.base.arrays import as_floats
from robsim.base.decimal_comma import suggest_decimal_point
from robsim.base.errors import UnitError, format_value
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.exact_quantity import ExactQuantity
from robsim.declare.scalars import LARGEST, Number
from robsim.declare.spec import DefineSchema, JSONSchema

LONGEST = 200  # characters of a quantity
SI: dict[si_units.Dimension, str] = {
    each: si_units.list_units(each)[0] for each in get_args(si_units.Dimension)
}
DIMENSIONS = {unit: dimension for dimension, unit in SI.items()}
EXAMPLES = {
    "angle": "90 deg",
    "length": "5 cm",
    "time": "40 ms",
    "turn rate": "30 deg/s",
    "speed": "5 cm/s",
    "turn acceleration": "60 deg/s^2",
    "acceleration": "1 m/s^2",
    "mass": "200 g",
    "density": "2.7 g/cm^3",
    "inertia": "1 g cm^2",
}


def read_quantity(raw: Raw, *of: str, count: int | None = None) -> Any:
    """Return a number in SI from a text such as "22.86 cm", or `count` from "1, 2, 3 mm".

    `of` are the SI units of the valid dimensions. The unit "1" stands for a number without a unit.
    """
    text, plain = isinstance(raw, str), isinstance(raw, int | float)
    if not (len(raw) <= LONGEST if text else plain and not abs(raw) > LARGEST):
        raise _make_unit_error(raw, of, count)
    values = _parse_quantity(" ".join(raw.split()) if text else raw, of, count)
    if not all(abs(number) <= LARGEST for number in (values if count else (values,))):
        raise UnitError(
            f"{format_value(raw)}: expected a number of at most {LARGEST:g} in SI units"
        )
    return values


def _parse_quantity(text: Raw, of: tuple[str, ...], count: int | None) -> Any:
    """Return numbers in SI from a text with a unit of one of the dimensions."""
    for unit in of:
        try:
            if unit == "1":
                return float(text)
            return si_units.parse(text, DIMENSIONS[unit], *([count] if count else []))
        except ValueError:
            if len(of) == 1 and unit != "1":
                raise
    raise _make_unit_error(text, of, count)


def _make_unit_error(raw: Raw, of: tuple[str, ...], count: int | None) -> UnitError:
    text = of != ("1",) and f"a short text with a unit, as in {format_examples(*of, count=count)}"
    expected = (text or "a bare number") + suggest_decimal_point(raw, count)
    return UnitError(f"{format_value(raw)}: expected {expected}")


def format_examples(*of: str, count: int | None = None) -> str:
    """Return examples of quantities of one or two of these SI units, as a phrase."""
    return " or ".join(f'"{format_example(unit, count)}"' for unit in of[:2])


def format_example(unit: str, count: int | None = None) -> str:
    """Return an example text of a quantity in an SI unit, or of `count` of them."""
    number, name = EXAMPLES[DIMENSIONS[unit]].split(" ", 1)
    return f"{', '.join('123'[:count]) if count else number} {name}"


class Bounds(TypedDict, total=False):
    """Bounds of a quantity in SI units; `above` and `below` are exclusive."""

    above: float
    least: float
    below: float
    most: float


@dataclass(frozen=True, kw_only=True)
class Quantity(Number):
    """A field with a number that has a unit in texts, such as "5 cm", and is in SI in Python.

    Parameters
    ----------
    above, least, below, most : float, optional
        Bounds in SI units; `above` and `below` are exclusive.
    dimension : str, default "length"
        Dimension, such as "length", "turn rate" or "mass".

    Examples
    --------
    >>> Quantity(dimension="speed", least=0).words()
    'a number (m/s) not below 0'
    """

    united: ClassVar[bool] = True

    dimension: si_units.Dimension = "length"

    @property
    def si_unit(self) -> str:
        return SI[self.dimension]

    @property
    def example(self) -> str:
        """An example text."""
        return format_example(self.si_unit)

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        return read_quantity(raw, self.si_unit)

    def write(self, value: FieldValue, c: Context) -> FieldValue:
        return ExactQuantity(value, self.si_unit)

    def text_words(self) -> str:
        return f'a quantity{self.bounds} such as "{self.example}"'

    def schema(self, define: DefineSchema) -> JSONSchema:
        pattern = si_units.make_quantity_pattern(self.dimension)
        return {"type": "string", "pattern": pattern, "examples": [self.example]}

    def rows(self, name: str) -> list[tuple[str, str]]:
        bounds = f",{self.bounds}" if self.bounds else ""
        return [(name, f'{self.dimension}, as in "{self.example}"{bounds}')]


def Length(**bounds: Unpack[Bounds]) -> Quantity:
    """Return the spec of a length in metres, with the bounds of `Quantity`.

    >>> Length(above=0).words()
    'a positive number (m)'
    """
    return Quantity(**bounds, dimension="length")


def Angle(**bounds: Unpack[Bounds]) -> Quantity:
    """Return the spec of an angle in radians, with the bounds of `Quantity`.

    >>> Angle().words()
    'a number (rad)'
    """
    return Quantity(**bounds, dimension="angle")


def Time(**bounds: Unpack[Bounds]) -> Quantity:
    """Return the spec of a time in seconds, with the bounds of `Quantity`.

    >>> Time(least=0).words()
    'a number (s) not below 0'
    """
    return Quantity(**bounds, dimension="time")


@dataclass(frozen=True)
class Vector(Quantity):
    """A field with several quantities of one dimension in one text, such as "1, 2, 3 mm".

    Parameters
    ----------
    dimension : str, default "length"
        Dimension.
    count : int, default 3
        Number of quantities.

    Examples
    --------
    >>> Vector(count=2).check([1, 2], "size")
    (1.0, 2.0)
    """

    dimension: si_units.Dimension = "length"
    count: int = 3

    @property
    def example(self) -> str:
        """An example text."""
        return format_example(self.si_unit, self.count)

    def find_violation(self, value: FieldValue) -> str:
        return "" if np.ndim(value) == 1 else self.accepts()

    def convert_python_value(self, value: FieldValue, what: str) -> FieldValue:
        return tuple(as_floats(value, what, (self.count,)).tolist())

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        return read_quantity(raw, self.si_unit, count=self.count)

    def words(self) -> str:
        return f'{self.count} numbers with a unit of {self.dimension}, as in "{self.example}"'

    def accepts(self) -> str:
        return f"{self.count} numbers ({self.si_unit})"

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        names = "xyz"[: self.count]
        return [] if value is None else [place.several(value, names, self.si_unit)]


@dataclass(frozen=True, kw_only=True)
class Amount(Number):
    """A number in SI or a quantity such as "5 cm", in one of the units that the context defines."""

    json: ClassVar[Mapping[str, Any]] = {"type": ["number", "string"]}

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        of = c.facts.get("of", DIMENSIONS)
        return read_quantity(raw, *of) if isinstance(raw, str) else super().parse_text_value(raw, c)

    def words(self) -> str:
        return f'{super().words()}, as in 0.05 or "5 cm"'
