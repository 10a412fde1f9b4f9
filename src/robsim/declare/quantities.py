"""Numbers with units in texts, SI inside."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

from robsim.base import units
from robsim.base.arrays import numbers
from robsim.base.errors import InputError, UnitError, said
from robsim.declare.scalars import LARGEST, Number
from robsim.declare.spec import Context, Raw, Spec, expected

LONGEST = 200  # characters of a quantity


SI: dict[units.Dimension, str] = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "speed": "m/s",
    "turn rate": "rad/s",
    "acceleration": "m/s^2",
    "turn acceleration": "rad/s^2",
    "mass": "kg",
    "density": "kg/m^3",
    "inertia": "kg m^2",
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


@dataclass(frozen=True)
class Quantity(Number):
    """A number with a unit in a text, such as "5 cm", which becomes one in SI."""

    united: ClassVar[bool] = True

    dimension: units.Dimension = "length"

    @property
    def si_unit(self) -> str:
        return SI[self.dimension]

    def check(self, value: Any, what: str) -> float:
        number = numbers(value, what, ())
        if isinstance(value, bool) or number.ndim or self._outside(float(number)):
            raise InputError(f"{what} must be {self.words()}, got {said(value)}")
        return float(number)

    def read(self, raw: Raw, c: Context) -> float:
        number = quantity(raw, self.dimension)
        if bound := self._outside(number):
            raise expected(bound, raw)
        return number

    def write(self, value: Any, c: Context) -> Any:
        return written(value, SI[self.dimension])

    def words(self) -> str:
        if self.above == 0 and self.below is None:
            return f"a positive number ({SI[self.dimension]})"
        return f"a number ({SI[self.dimension]}) {self._bounds()}".rstrip()

    def text_words(self) -> str:
        bounds = f" {self._bounds()}" if self._bounds() else ""
        return f'a quantity{bounds} such as "{EXAMPLES[self.dimension]}"'

    def schema(self, define: Any) -> dict[str, Any]:
        pattern = units.pattern(self.dimension)
        return {"type": "string", "pattern": pattern, "examples": [EXAMPLES[self.dimension]]}

    def rows(self, name: str) -> list[tuple[str, str]]:
        bounds = f", {self._bounds()}" if self._bounds() else ""
        return [(name, f'{self.dimension}, as in "{EXAMPLES[self.dimension]}"{bounds}')]

    def _slide(self) -> tuple[Any, ...]:
        _, low, high, _ = super()._slide()
        return SI[self.dimension], low, high, True


def Length(**bounds: Any) -> Quantity:
    """Return a length in metres."""
    return Quantity(**bounds, dimension="length")


def Angle(**bounds: Any) -> Quantity:
    """Return an angle in radians."""
    return Quantity(**bounds, dimension="angle")


def Time(**bounds: Any) -> Quantity:
    """Return a time in seconds."""
    return Quantity(**bounds, dimension="time")


@dataclass(frozen=True)
class Vector(Spec):
    """Several quantities of one dimension in one text, such as "1, 2, 3 mm"."""

    united: ClassVar[bool] = True

    dimension: units.Dimension = "length"
    count: int = 3

    @property
    def si_unit(self) -> str:
        return SI[self.dimension]

    def check(self, value: Any, what: str) -> tuple[float, ...]:
        given = numbers(value, what, (self.count,))
        if given.ndim != 1:
            raise InputError(f"{what}: expected shape ({self.count},), got {given.shape}")
        return tuple(given.tolist())

    def read(self, raw: Raw, c: Context) -> tuple[float, ...]:
        return quantities(raw, self.dimension, self.count)

    def write(self, value: Any, c: Context) -> str:
        return listed(value, SI[self.dimension])

    def words(self) -> str:
        return f'{self.count} numbers with a unit of {self.dimension}, as in "{self._example}"'

    def accepts(self) -> str:
        return f"{self.count} numbers ({SI[self.dimension]})"

    def schema(self, define: Any) -> dict[str, Any]:
        pattern = units.pattern(self.dimension)
        return {"type": "string", "pattern": pattern, "examples": [self._example]}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return [] if value is None else [place.several(value, "xyz", SI[self.dimension])]

    @property
    def _example(self) -> str:
        return f"{', '.join('123'[: self.count])} {EXAMPLES[self.dimension].split(' ', 1)[1]}"


def quantity(raw: Raw, dimension: units.Dimension) -> float:
    """Return one number in SI from a text such as "22.86 cm"."""
    return _numbers(raw, dimension, None)[0]


def quantities(raw: Raw, dimension: units.Dimension, count: int) -> tuple[float, ...]:
    """Return several numbers in SI from a text such as "1, 2, 3 mm"."""
    return _numbers(raw, dimension, count)


def coordinate(raw: Raw, unit: str) -> float:
    """Return one coordinate or velocity; its unit, such as "rad" or "m/s", as the joint has it.

    The numbers of a quaternion, of unit "1", are bare.
    """
    if unit != "1":
        return quantity(raw, DIMENSIONS[unit])
    try:
        return _within(float(raw), raw)
    except (TypeError, ValueError, OverflowError):
        raise UnitError(f"{said(raw)}: expected a bare number") from None


def either(raw: Raw, *dimensions: units.Dimension) -> float:
    """Return a quantity of one of these dimensions, where the joint is not known yet."""
    for dimension in dimensions:
        try:
            return quantity(raw, dimension)
        except _TooLarge:
            raise
        except UnitError:
            continue
    examples = " or ".join(f'"{EXAMPLES[dimension]}"' for dimension in dimensions)
    raise UnitError(f"{said(raw)}: expected one number with its unit, as in {examples}")


class Exact(str):
    """The text of numbers in SI, such as '0.1, 0.2 m', which knows them."""

    numbers: tuple[float, ...]
    unit: str

    def __new__(cls, numbers: Iterable[Any], unit: str) -> Exact:
        """Return the text of some numbers; bare where their unit is "1"."""
        own = tuple(map(float, numbers))
        made = super().__new__(cls, f"{', '.join(map(repr, own))} {unit}".removesuffix(" 1"))
        made.numbers, made.unit = own, unit
        return made


def written(number: float, unit: str) -> str:
    """Return the text of a number with its unit, such as '0.1 m'; bare where the unit is "1"."""
    return Exact([number], unit)


def listed(values: Any, unit: str) -> str:
    """Return the text of several numbers with their unit, such as '0.1, 0.2 kg m^2'."""
    return Exact(values, unit)


class _TooLarge(UnitError):
    """The error about a quantity of the right dimension that is too large."""


def _numbers(raw: Raw, dimension: units.Dimension, count: int | None) -> tuple[float, ...]:
    text = _short(raw, f'"{", ".join("123"[:count])} cm"' if count else '"1.5 cm"')
    read = units.parse(text, dimension, count) if count else (units.parse(text, dimension),)
    return tuple(_within(number, raw) for number in read)


def _short(raw: Raw, example: str) -> Any:
    """Return what `units.parse` may see: a short text, or a number, which it refuses."""
    if isinstance(raw, str) and len(raw) <= LONGEST:
        return " ".join(raw.split())
    if isinstance(raw, int | float) and not abs(raw) > LARGEST:
        return raw
    raise UnitError(f"{said(raw)}: expected a short text with a unit, as in {example}")


def _within(number: float, raw: Raw) -> float:
    if not abs(number) <= LARGEST:
        raise _TooLarge(f"{said(raw)}: expected a number of at most {LARGEST:g} in SI units")
    return number
