"""Scalar fields: numbers within bounds, integers and truth values."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robsim.base.arrays import as_floats
from robsim.base.errors import InputError, format_value
from robsim.declare.context import Context, FieldValue, NoTextError, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.spec import DefineSchema, JSONSchema, Spec, make_expected_error

LARGEST = 1e9  # bound of all numbers in SI units, so that no product of poses overflows


class Bound(NamedTuple):
    """A kind of bound: its word, the phrase of an error, its comparison, and its schema key."""

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


@dataclass(frozen=True)
class PlainValue(Spec):
    """A field with a value that a single test accepts or rejects, in a text and in Python."""

    def find_violation(self, value: object) -> str:
        """Return a phrase for the valid values if a value is not valid, or ""."""
        raise NotImplementedError

    def convert_python_value(self, value: object, what: str) -> FieldValue:
        """Return a Python value in its stored type, or unchanged if it is not valid."""
        return value

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        """Return the value of a text in its stored type, or unchanged if it is not valid."""
        return raw

    def require_valid(self, value: object, raw: Raw) -> FieldValue:
        """Return a value that was read from `raw`; InputError unless it is valid."""
        if demand := self.find_violation(value):
            raise make_expected_error(demand, raw)
        return value

    def check(self, value: object, what: str) -> FieldValue:
        taken = self.convert_python_value(value, what)
        if self.find_violation(taken):
            raise InputError(f"{what} must be {self.accepts()}, got {format_value(value)}")
        return taken

    def read(self, raw: Raw, c: Context) -> FieldValue:
        return self.require_valid(self.parse_text_value(raw, c), raw)

    def write(self, value: object, c: Context) -> FieldValue:
        if demand := self.find_violation(value):
            raise NoTextError(f"{format_value(value)} is not {demand}")
        return value


@dataclass(frozen=True, kw_only=True)
class Number(PlainValue):
    """A field with a finite number within bounds.

    Parameters
    ----------
    above, below : float, optional
        Exclusive bounds.
    least, most : float, optional
        Inclusive bounds.
    unit : str, optional
        Unit for messages and documents, if it is not an SI unit.

    Examples
    --------
    >>> Number(above=0, most=1).check(0.5, "share")
    0.5
    >>> Number(above=0, unit="px").words()
    'a positive number (px)'
    """

    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    unit: str = ""

    @cached_property
    def limits(self) -> list[tuple[Bound, float]]:
        """The declared bounds, each with its number."""
        own = ((bound, getattr(self, name)) for name, bound in BOUNDS.items())
        return [(bound, limit) for bound, limit in own if limit is not None]

    @property
    def bounds(self) -> str:
        """The bounds as the end of a phrase; "" if there are none."""
        return " and".join(f" {bound.word} {limit:g}" for bound, limit in self.limits)

    def find_violation(self, value: object) -> str:
        if not isinstance(value, float) or not math.isfinite(value):
            return "a finite number"
        for bound, limit in self.limits:
            if not bound.holds(value, limit):
                return f"{bound.demand} {limit:g}"
        return ""

    def convert_python_value(self, value: FieldValue, what: str) -> FieldValue:
        return as_floats(value, what, ()).tolist()

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            raise make_expected_error("a valid number", raw)
        if LARGEST < abs(raw) < math.inf:
            raise make_expected_error(f"a number of at most {LARGEST:g}", raw)
        return float(raw)

    def write(self, value: FieldValue, c: Context) -> FieldValue:
        return super().write(float(value), c)

    def words(self) -> str:
        unit = f" ({self.si_unit})" if self.si_unit else ""
        if self.above == 0 and self.below is None:
            return f"a positive number{unit}"
        return f"a number{unit}{self.bounds}"

    def schema(self, define: DefineSchema) -> JSONSchema:
        bounds = {bound.key: limit for bound, limit in self.limits}
        return dict(self.json) or {"type": "number", **bounds}

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        if not isinstance(value, float | int) or not math.isfinite(value):
            return ()
        ends = self.above is not None, self.below is not None
        low, high = self.above if ends[0] else self.least, self.below if ends[1] else self.most
        return [place.slider(value, self.si_unit, low, high, self.united, ends)]


ANY, POSITIVE, NOT_NEGATIVE = Number(), Number(above=0), Number(least=0)


@dataclass(frozen=True)
class Integer(PlainValue):
    """A field with a whole number.

    Parameters
    ----------
    least, most : int, default 0 and 2**63 - 1
        Inclusive bounds.

    Examples
    --------
    >>> Integer(1).check(3.0, "count"), Integer(1).words()
    (3, 'a whole number from 1 on')
    """

    least: int = 0
    most: int = 2**63 - 1

    def find_violation(self, value: FieldValue) -> str:
        whole = isinstance(value, int) and not isinstance(value, bool)
        return "" if whole and self.least <= value <= self.most else self.words()

    def convert_python_value(self, value: FieldValue, what: str) -> FieldValue:
        number = as_floats(value, what, ())
        return int(value) if not number.ndim and number == np.round(number) else value

    def words(self) -> str:
        most = f"to {self.most}" if self.most < 2**63 - 1 else "on"
        return f"a whole number from {self.least} {most}"

    def schema(self, define: DefineSchema) -> JSONSchema:
        return {"type": "integer", "minimum": self.least, "maximum": self.most}

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        if not isinstance(value, int):
            return ()
        return [place.control("whole", value, low=self.least, high=self.most)]


@dataclass(frozen=True)
class Flag(PlainValue):
    """A field with a truth value.

    >>> Flag().check(True, "hold")
    True
    """

    phrase: ClassVar[str] = "true or false"
    json: ClassVar[Mapping[str, Any]] = {"type": "boolean"}

    def find_violation(self, value: object) -> str:
        return "" if isinstance(value, bool) else self.words()

    def convert_python_value(self, value: object, what: str) -> FieldValue:
        return bool(value) if isinstance(value, np.bool_) else value

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        return [place.control("flag", value)] if isinstance(value, bool) else ()
