"""Plain values: numbers within bounds, whole numbers and truth values."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robsim.base.arrays import Array, numbers
from robsim.base.errors import InputError, said
from robsim.declare.spec import Context, NoText, Raw, Spec, expected

LARGEST = 1e9  # of any number in SI units, so that no product of poses overflows


class Bound(NamedTuple):
    """How a bound is said, how one that is broken is, what keeps it, and its key in a schema."""

    word: str
    demand: str
    holds: Callable[[float, float], bool]
    key: str


BOUNDS = {
    "above": Bound("above", "greater than", operator.gt, "exclusiveMinimum"),
    "least": Bound("not below", "greater than or equal to", operator.ge, "minimum"),
    "below": Bound("below", "less than", operator.lt, "exclusiveMaximum"),
    "most": Bound("not above", "less than or equal to", operator.le, "maximum"),
}


@dataclass(frozen=True, kw_only=True)
class Number(Spec):
    """A finite number within bounds, in `unit` where that is not an SI unit."""

    shape: ClassVar[Any] = ()  # of the numbers of one value

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    unit: str = ""

    @cached_property
    def limits(self) -> list[tuple[Bound, float]]:
        """The bounds that are given, each with its number."""
        own = ((bound, getattr(self, name)) for name, bound in BOUNDS.items())
        return [(bound, limit) for bound, limit in own if limit is not None]

    @property
    def bounds(self) -> str:
        """What bounds a number, as the end of a phrase; "" where nothing does."""
        return " and".join(f" {bound.word} {limit:g}" for bound, limit in self.limits)

    def broken(self, number: float) -> str:
        """Return what a number must be for the first bound that it breaks, or ""."""
        for bound, limit in self.limits:
            if not bound.holds(number, limit):
                return f"{bound.demand} {limit:g}"
        return ""

    def within(self, number: float, raw: Raw) -> float:
        """Return a number that a text says as `raw`; InputError if it breaks a bound."""
        if demand := self.broken(number):
            raise expected(demand, raw)
        return number

    def check(self, value: Any, what: str) -> Any:
        number = checked_numbers(value, what, self, self).tolist()
        return tuple(number) if self.shape else number

    def read(self, raw: Raw, c: Context) -> Any:
        return self.within(bare(raw), raw)

    def write(self, value: Any, c: Context) -> Any:
        if not math.isfinite(value):
            raise NoText(f"{value!r} is not a finite number")
        return float(value)

    def words(self) -> str:
        unit = f" ({self.si_unit})" if self.si_unit else ""
        if self.above == 0 and self.below is None:
            return f"a positive number{unit}"
        return f"a number{unit}{self.bounds}"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "number", **{bound.key: limit for bound, limit in self.limits}}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        if not isinstance(value, float | int) or not math.isfinite(value):
            return ()
        ends = self.above is not None, self.below is not None
        low, high = self.above if ends[0] else self.least, self.below if ends[1] else self.most
        return [place.slider(value, self.si_unit, low, high, self.united, ends)]


ANY, POSITIVE, NOT_NEGATIVE = Number(), Number(above=0), Number(least=0)


def checked_numbers(value: Any, what: str, spec: Any, item: Number) -> Array:
    """Return an array of the shape of a spec, each number of which keeps the bounds of `item`.

    Without a shape it may be a number, a list of them, or rows.
    """
    array = numbers(value, what, spec.shape or ())
    each = array.ravel().tolist() if item.limits else []
    deepest = 2 if spec.shape is None else len(spec.shape)
    wrong = isinstance(value, bool) or array.ndim > deepest or not array.size
    if wrong or any(map(item.broken, each)):
        raise InputError(f"{what} must be {spec.accepts()}, got {said(value)}")
    return array


def bare(raw: Raw) -> float:
    """Return a number without a unit."""
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise expected("a valid number", raw)
    if isinstance(raw, float) and not math.isfinite(raw):
        raise expected("a finite number", raw)
    if abs(raw) > LARGEST:
        raise expected(f"a number of at most {LARGEST:g}", raw)
    return float(raw)


@dataclass(frozen=True)
class Plain(Spec):
    """A value that is the same in a text and in Python."""

    def demand(self, value: Any) -> str:
        """Return what a value must be where it is something else, or ""."""
        raise NotImplementedError

    def check(self, value: Any, what: str) -> Any:
        if demand := self.demand(value):
            raise InputError(f"{what} must be {demand}, got {said(value)}")
        return value

    def read(self, raw: Raw, c: Context) -> Any:
        if demand := self.demand(raw):
            raise expected(demand, raw)
        return raw

    def write(self, value: Any, c: Context) -> Any:
        if demand := self.demand(value):
            raise NoText(f"{said(value)} is not {demand}")
        return value


@dataclass(frozen=True)
class Whole(Plain):
    """A whole number from `least` to `most`."""

    least: int = 0
    most: int = 2**63 - 1

    def demand(self, value: Any) -> str:
        whole = isinstance(value, int) and not isinstance(value, bool)
        return "" if whole and self.least <= value <= self.most else self.words()

    def check(self, value: Any, what: str) -> Any:
        number = numbers(value, what, ())
        whole = not isinstance(value, bool) and not number.ndim and number == np.round(number)
        return super().check(int(value) if whole else value, what)

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
class Flag(Plain):
    """A truth value."""

    def demand(self, value: Any) -> str:
        return "" if isinstance(value, bool) else self.words()

    def check(self, value: Any, what: str) -> Any:
        return super().check(bool(value) if isinstance(value, np.bool_) else value, what)

    def words(self) -> str:
        return "true or false"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "boolean"}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return [place.control("flag", value)] if isinstance(value, bool) else ()
