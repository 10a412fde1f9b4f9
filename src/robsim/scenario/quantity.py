"""The kinds of value in a scenario file: a text with a unit goes in, SI comes out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field

from robsim.base import units
from robsim.base.errors import UnitError
from robsim.base.names import checked_name
from robsim.scenario.problems import shown

LARGEST = 1e9  # of any number in SI units, so that no product of poses overflows
_LONGEST = 200  # characters of a quantity
DIMENSIONS: dict[str, units.Dimension] = {
    "rad": "angle",
    "m": "length",
    "rad/s": "turn rate",
    "m/s": "speed",
    "rad/s^2": "turn acceleration",
    "m/s^2": "acceleration",
}
_EXAMPLES = {
    "angle": "90 deg",
    "length": "5 cm",
    "turn rate": "30 deg/s",
    "speed": "5 cm/s",
    "turn acceleration": "60 deg/s^2",
    "acceleration": "1 m/s^2",
}


def quantity(value: Any, dimension: units.Dimension) -> float:
    """One number from a text such as "22.86 cm"."""
    return _numbers(value, dimension, None)[0]


def vector(value: Any, dimension: units.Dimension) -> tuple[float, ...]:
    """Three numbers from a text such as "1, 2, 3 mm"."""
    return _numbers(value, dimension, 3)


def pair(value: Any, dimension: units.Dimension) -> tuple[float, ...]:
    """Two numbers from a text such as "1, 2 m"."""
    return _numbers(value, dimension, 2)


def coordinate(value: Any, unit: str) -> float:
    """One coordinate or velocity of a robot; its unit, such as "rad" or "m/s", as Robot tells.

    The numbers of a quaternion, of unit "1", are bare.
    """
    if unit != "1":
        return quantity(value, DIMENSIONS[unit])
    try:
        return _within(float(value), value)
    except (TypeError, ValueError, OverflowError):
        raise UnitError(f"{shown(value)}: expected a bare number") from None


def either(value: Any, *dimensions: units.Dimension) -> float:
    """A quantity of one of these dimensions; which one is right is known once the robots are."""
    for dimension in dimensions:
        try:
            return quantity(value, dimension)
        except _TooLarge:
            raise
        except UnitError:
            continue
    examples = " or ".join(f'"{_EXAMPLES[dimension]}"' for dimension in dimensions)
    raise UnitError(f"{shown(value)}: expected one number with its unit, as in {examples}")


def _numbers(value: Any, dimension: units.Dimension, count: int | None) -> tuple[float, ...]:
    text = _short(value, f'"{", ".join("123"[:count])} cm"' if count else '"1.5 cm"')
    read = units.parse(text, dimension, count) if count else (units.parse(text, dimension),)
    return tuple(_within(number, value) for number in read)


def _short(value: Any, example: str) -> Any:
    """What `units.parse` may see: short texts, and numbers (it says that they lack a unit)."""
    if isinstance(value, str) and len(value) <= _LONGEST:
        return " ".join(value.split())
    if isinstance(value, int | float) and not abs(value) > LARGEST:
        return value
    raise UnitError(f"{shown(value)}: expected a short text with a unit, as in {example}")


class _TooLarge(UnitError):
    """A quantity of the right dimension."""


def _within(number: float, value: Any) -> float:
    if not abs(number) <= LARGEST:
        raise _TooLarge(f"{shown(value)}: expected a number of at most {LARGEST:g} in SI units")
    return number


def _reads(read: Callable[..., Any], dimension: units.Dimension) -> BeforeValidator:
    return BeforeValidator(lambda value: read(value, dimension))


def _focal(value: Any) -> Any:
    """Two focal lengths; one number is both."""
    return [value, value] if isinstance(value, int | float) else value


def _depth(value: Any) -> Any:
    try:
        depth = value if value in ("true", "goal") else quantity(value, "length")
    except UnitError:
        depth = None
    if depth is None or (not isinstance(depth, str) and depth <= 0):
        choices = (
            'expected "true", "goal", a length above zero such as "30 cm", or the table of a filter'
        )
        raise UnitError(f"{shown(value)}: {choices}")
    return depth


def _record(value: Any) -> Any:
    whole = isinstance(value, int) and not isinstance(value, bool) and value >= 1
    if whole or value in ("all", "summary"):
        return value
    choices = 'expected "all", "summary" or a whole number n, to keep every n-th step'
    raise UnitError(f"{shown(value)}: {choices}")


def _raw_coordinate(value: Any) -> Any:
    """A text or a number: which unit it needs is known once the robots are."""
    if isinstance(value, str) or (isinstance(value, int | float) and not isinstance(value, bool)):
        return value
    raise UnitError(f'{shown(value)}: expected a text with a unit, as in "90 deg" or "5 cm"')


def forms(*others: str) -> Discriminator:
    """Which way of saying a value this is: "list" or "table", if these are `others`; or "plain"."""

    def form(value: Any) -> str:
        found = "list" if isinstance(value, list) else "table"
        return found if isinstance(value, list | dict) and found in others else "plain"

    return Discriminator(form)


Name = Annotated[str, AfterValidator(lambda value: checked_name(value, "name"))]
Text = Annotated[str, Field(max_length=2000)]
Reference = Annotated[str, Field(max_length=129)]  # robot.link
Color = Annotated[str, Field(pattern=r"^[A-Za-z0-9#][A-Za-z0-9 #:._-]{0,63}$")]

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0, le=LARGEST)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Row = Annotated[list[Number], Field(min_length=3, max_length=3)]
Matrix = Annotated[list[Row], Field(min_length=3, max_length=3)]
Focal = Annotated[list[Positive], Field(min_length=2, max_length=2), BeforeValidator(_focal)]
Pixels = Annotated[int, Field(ge=1, le=1_000_000)]
Size = Annotated[list[Pixels], Field(min_length=2, max_length=2)]

Vector = tuple[float, float, float]
Length = Annotated[float, _reads(quantity, "length")]
Angle = Annotated[float, _reads(quantity, "angle")]
Extent = Annotated[float, Field(gt=0), _reads(quantity, "length")]  # a length above zero
Period = Annotated[float, Field(gt=0), _reads(quantity, "time")]
Place = Annotated[tuple[float, float], _reads(pair, "length")]  # in a plane
Position = Annotated[Vector, _reads(vector, "length")]
Angles = Annotated[Vector, _reads(vector, "angle")]
Speed = Annotated[float, Field(gt=0), _reads(quantity, "speed")]
TurnRate = Annotated[float, Field(gt=0), _reads(quantity, "turn rate")]
AnySpeed = Annotated[
    float, Field(gt=0), BeforeValidator(lambda value: either(value, "turn rate", "speed"))
]
Acceleration = Annotated[float, Field(gt=0), _reads(quantity, "acceleration")]
TurnAcceleration = Annotated[float, Field(gt=0), _reads(quantity, "turn acceleration")]
Mass = Annotated[float, Field(gt=0), _reads(quantity, "mass")]
Density = Annotated[float, Field(gt=0), _reads(quantity, "density")]
Moments = Annotated[Vector, _reads(vector, "inertia")]
Instant = Annotated[float, Field(ge=0), _reads(quantity, "time")]
Coordinate = Annotated[Any, BeforeValidator(_raw_coordinate)]
Depth = Annotated[Any, BeforeValidator(_depth)]
Record = Annotated[Any, BeforeValidator(_record)]
