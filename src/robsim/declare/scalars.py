"""Plain values: numbers, whole numbers and truth values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import flag, numbers
from robsim.base.errors import InputError, said
from robsim.declare.spec import Context, NoText, Raw, Spec, expected

LARGEST = 1e9  # of any number in SI units, so that no product of poses overflows


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
            raise InputError(f"{what}{unit} must be {self.words()}, got {said(value)}")
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

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        if not isinstance(value, float | int) or not math.isfinite(value):
            return ()
        ends = self.above is not None, self.below is not None
        return [place.slider(value, *self._slide(), ends)]

    def _slide(self) -> tuple[Any, ...]:
        """Return the unit in which a number is shown, its bounds, and whether texts have it."""
        low = self.least if self.above is None else self.above
        return self.unit, low, self.most if self.below is None else self.below, False

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
class Whole(Spec):
    """A whole number from `least` to `most`."""

    least: int = 0
    most: int = 2**63 - 1

    def check(self, value: Any, what: str) -> int:
        number = numbers(value, what, ())
        whole = not isinstance(value, bool) and not number.ndim and number == np.round(number)
        if not whole or not self.least <= int(value) <= self.most:
            raise InputError(f"{what} must be {self.words()}, got {said(value)}")
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

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        if not isinstance(value, int):
            return ()
        return [place.control("whole", value, low=self.least, high=self.most)]


@dataclass(frozen=True)
class Flag(Spec):
    """A truth value."""

    def check(self, value: Any, what: str) -> bool:
        return flag(value, what)

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

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return [place.control("flag", value)] if isinstance(value, bool) else ()


# texts with units
