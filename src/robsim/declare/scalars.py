"""Plain values: numbers, quantities with a unit, words, names and truth values."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base import units
from robsim.base.arrays import numbers
from robsim.base.errors import InputError, UnitError, suggest
from robsim.base.names import NAME_PATTERN, checked_name
from robsim.declare.families import plural
from robsim.declare.problems import shown
from robsim.declare.spec import Context, NoText, Raw, Spec, expected

LARGEST = 1e9  # of any number in SI units, so that no product of poses overflows
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
class Number(Spec):
    """A finite number within bounds, in `unit` where that is not an SI unit."""

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    unit: str = ""

    def check(self, value: Any, what: str) -> float:
        number = numbers(value, what, ())
        if isinstance(value, bool) or number.ndim or self._outside(float(number)):
            unit = f" ({self.unit})" if self.unit else ""
            raise InputError(f"{what}{unit} must be {self.words()}, got {value!r:.80}")
        return float(number)

    def read(self, raw: Raw, c: Context) -> float:
        number = bare(raw)
        if bound := self._outside(number) or (abs(number) > LARGEST and f"at most {LARGEST:g}"):
            raise expected(bound, raw)
        return number

    def write(self, value: Any, c: Context) -> float:
        if not math.isfinite(value):
            raise NoText(f"{value!r} is not a finite number")
        return float(value)

    def words(self) -> str:
        if self.above == 0 and self.below is None:
            return "a positive number"
        return f"a number {self._bounds()}".rstrip()

    def accepts(self) -> str:
        return f"{self.words()} ({self.unit})" if self.unit else self.words()

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "number", **self._limits()}

    def wrong(self) -> Sequence[Raw]:
        outside = [bound for bound in (self.above, self.below) if bound is not None]
        outside += [self.least - 1.0] if self.least is not None else []
        outside += [self.most + 1.0] if self.most is not None else []
        return ["fast", True, math.nan, math.inf, [1.0, [2.0]], *outside]

    def _outside(self, number: float) -> str:
        """Return the bound that a number breaks."""
        if self.above is not None and not number > self.above:
            return f"greater than {self.above:g}"
        if self.least is not None and not number >= self.least:
            return f"greater than or equal to {self.least:g}"
        if self.below is not None and not number < self.below:
            return f"less than {self.below:g}"
        if self.most is not None and not number <= self.most:
            return f"less than or equal to {self.most:g}"
        return ""

    def _bounds(self) -> str:
        said = {
            "above": self.above,
            "not below": self.least,
            "below": self.below,
            "not above": self.most,
        }
        return " and ".join(f"{word} {x:g}" for word, x in said.items() if x is not None)

    def _limits(self) -> dict[str, float]:
        named = {
            "exclusiveMinimum": self.above,
            "minimum": self.least,
            "exclusiveMaximum": self.below,
            "maximum": self.most,
        }
        return {key: x for key, x in named.items() if x is not None}


def bare(raw: Raw) -> float:
    """Return a number without a unit."""
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise expected("a valid number", raw)
    try:
        number = float(raw)
    except OverflowError:
        raise expected("a finite number", raw) from None
    if not math.isfinite(number):
        raise expected("a finite number", raw)
    return number


@dataclass(frozen=True)
class Quantity(Number):
    """A number with a unit in a text, such as "5 cm", which becomes one in SI."""

    united: ClassVar[bool] = True

    dimension: units.Dimension = "length"

    def check(self, value: Any, what: str) -> float:
        number = numbers(value, what, ())
        if isinstance(value, bool) or number.ndim or self._outside(float(number)):
            raise InputError(f"{what} must be {self.words()}, got {value!r:.80}")
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

    def wrong(self) -> Sequence[Raw]:
        unit = SI[self.dimension]
        outside = [bound for bound in (self.above, self.below) if bound is not None]
        other = "3 kg" if self.dimension != "mass" else "3 m"
        return [1.0, "fast", other, True, f"nan {unit}", *(f"{x} {unit}" for x in outside)]


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

    def wrong(self) -> Sequence[Raw]:
        return [3, "1 kg", "1, 2, 3, 4, 5 m", ["1 m"]]

    @property
    def _example(self) -> str:
        return f"{', '.join('123'[: self.count])} {EXAMPLES[self.dimension].split(' ', 1)[1]}"


@dataclass(frozen=True)
class Whole(Spec):
    """A whole number from `least` to `most`."""

    least: int = 0
    most: int = 2**63 - 1

    def check(self, value: Any, what: str) -> int:
        number = numbers(value, what, ())
        whole = not isinstance(value, bool) and not number.ndim and number == np.round(number)
        if not whole or not self.least <= int(value) <= self.most:
            raise InputError(f"{what} must be {self.words()}, got {value!r:.80}")
        return int(value)

    def read(self, raw: Raw, c: Context) -> int:
        if isinstance(raw, bool) or not isinstance(raw, int):
            raise expected("a valid integer", raw)
        if raw < self.least:
            raise expected(f"greater than or equal to {self.least}", raw)
        if raw > self.most:
            raise expected(f"less than or equal to {self.most}", raw)
        return raw

    def write(self, value: Any, c: Context) -> int:
        return int(value)

    def words(self) -> str:
        most = f"to {self.most}" if self.most < 2**63 - 1 else "on"
        return f"a whole number from {self.least} {most}"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "integer", "minimum": self.least, "maximum": self.most}

    def wrong(self) -> Sequence[Raw]:
        return ["one", 1.5, True, self.least - 1, self.most + 1]


@dataclass(frozen=True)
class Flag(Spec):
    """A truth value."""

    def check(self, value: Any, what: str) -> bool:
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"{what} must be True or False, got {value!r:.80}")
        return bool(value)

    def read(self, raw: Raw, c: Context) -> bool:
        if not isinstance(raw, bool):
            raise expected("a valid boolean", raw)
        return raw

    def write(self, value: Any, c: Context) -> bool:
        return bool(value)

    def words(self) -> str:
        return "true or false"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "boolean"}

    def wrong(self) -> Sequence[Raw]:
        return [1, "yes"]


@dataclass(frozen=True)
class Text(Spec):
    """A text of a bounded length, which may have to fit a pattern."""

    most: int = 2000
    pattern: str | None = None
    least: int = 0

    def check(self, value: Any, what: str) -> str:
        if not isinstance(value, str):
            raise InputError(f"{what}: expected a text, got {value!r:.80}")
        return value

    def read(self, raw: Raw, c: Context) -> str:
        if not isinstance(raw, str):
            raise expected("a valid string", raw)
        if not self.least <= len(raw) <= self.most:
            raise expected(f"a string of {self.least} to {self.most} characters", raw)
        if self.pattern and not re.fullmatch(self.pattern, raw):
            raise expected(f"a string of the pattern {self.pattern}", raw)
        return raw

    def write(self, value: Any, c: Context) -> str:
        if not isinstance(value, str):
            raise NoText(f"{value!r:.40} is not a text")
        return value

    def words(self) -> str:
        return "a text"

    def schema(self, define: Any) -> dict[str, Any]:
        pattern = {"pattern": f"^{self.pattern}$"} if self.pattern else {}
        return {"type": "string", "minLength": self.least, "maxLength": self.most, **pattern}

    def wrong(self) -> Sequence[Raw]:
        return [3, "x" * (self.most + 1)]


@dataclass(frozen=True)
class Name(Text):
    """A name that is safe in files, figures and paths."""

    most: int = 64

    def read(self, raw: Raw, c: Context) -> str:
        if not isinstance(raw, str):
            raise expected("a valid string", raw)
        return checked_name(raw, "name")

    def words(self) -> str:
        return "a name"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "string", "pattern": f"^{NAME_PATTERN}$"}

    def wrong(self) -> Sequence[Raw]:
        return [3, "two words", "1st", ""]


Reference = Text(most=129)  # robot.link


@dataclass(frozen=True)
class ColorSpec(Text):
    """A colour by a name that Matplotlib knows; in Python in any form that Matplotlib takes."""

    pattern: str | None = r"[A-Za-z0-9#][A-Za-z0-9 #:._-]{0,63}"

    def check(self, value: Any, what: str) -> Any:
        return value  # which only Matplotlib knows

    def write(self, value: Any, c: Context) -> str:
        if not isinstance(value, str):
            raise NoText(f"the color {value!r:.40} is not a text")
        return value


Color = ColorSpec()


@dataclass(frozen=True)
class Word(Spec):
    """One of a few words."""

    choices: tuple[str, ...]
    noun: str = "choice"
    form: ClassVar[str] = "plain"

    def check(self, value: Any, what: str) -> str:
        if not isinstance(value, str) or value not in self.choices:
            hint = suggest(value, self.choices, plural(self.noun))
            raise InputError(f"{what}: no {self.noun} {value!r:.80}; {hint}")
        return value

    def read(self, raw: Raw, c: Context) -> str:
        if not isinstance(raw, str) or raw not in self.choices:
            raise expected(self.words(), raw)
        return raw

    def write(self, value: Any, c: Context) -> str:
        return str(value)

    def words(self) -> str:
        *most, last = map(repr, self.choices)
        return f"{', '.join(most)} or {last}" if most else last

    def schema(self, define: Any) -> dict[str, Any]:
        return {"enum": list(self.choices)}

    def wrong(self) -> Sequence[Raw]:
        return [3, "none of them", ["x"]]


# texts with units


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
        raise UnitError(f"{shown(raw)}: expected a bare number") from None


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
    raise UnitError(f"{shown(raw)}: expected one number with its unit, as in {examples}")


def written(number: float, unit: str) -> str:
    """Return the text of a number with its unit, such as '0.1 m'; bare where the unit is "1"."""
    return f"{float(number)!r} {unit}" if unit != "1" else repr(float(number))


def listed(values: Any, unit: str) -> str:
    """Return the text of several numbers with their unit, such as '0.1, 0.2 kg m^2'."""
    return f"{', '.join(repr(float(x)) for x in values)} {unit}"


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
    raise UnitError(f"{shown(raw)}: expected a short text with a unit, as in {example}")


def _within(number: float, raw: Raw) -> float:
    if not abs(number) <= LARGEST:
        raise _TooLarge(f"{shown(raw)}: expected a number of at most {LARGEST:g} in SI units")
    return number
