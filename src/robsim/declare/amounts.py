"""Numbers whose unit only their place tells, or several of them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast, get_args

from robsim.base.arrays import frozen, numbers
from robsim.base.errors import InputError, UnitError, said
from robsim.base.units import Dimension, parse
from robsim.declare.quantities import DIMENSIONS, EXAMPLES, SI, written
from robsim.declare.spec import Context, Raw, Spec, expected


@dataclass(frozen=True)
class Amount(Spec):
    """A number in SI, a quantity such as "5 cm", or a list of these, which becomes an array.

    What it is of, and hence its unit, is for the one who uses it to know. With `count` it is a
    list of so many.
    """

    count: int | None = None
    above: float | None = None
    least: float | None = None
    unit: str = ""  # in SI, of a quantity in a text, which then has one

    def check(self, value: Any, what: str) -> Any:
        array = numbers(value, what, () if self.count is None else (self.count,))
        if isinstance(value, bool) or array.ndim > 2 or not array.size or self._outside(array):
            raise InputError(f"{what}: expected {self.words()}, got {said(value)}")
        return frozen(array)

    def read(self, raw: Raw, c: Context) -> Any:
        array = numbers(_in_si(raw, self.unit), str(c.path[-1]) if c.path else "value", ())
        if (self.count is not None and array.shape[-1:] != (self.count,)) or self._outside(array):
            raise expected(self.words(), raw)
        return frozen(array)

    def write(self, value: Any, c: Context) -> Any:
        return _in_unit(value.tolist(), self.unit)

    def words(self) -> str:
        bound = "above 0" if self.above == 0 else "not below 0" if self.least == 0 else ""
        if self.count is not None:
            return f"{self.count} numbers {bound}".rstrip() + ", in SI or with a unit"
        return f"a number {bound}".rstrip() + ', in SI or with a unit ("5 cm"), or a list of these'

    def schema(self, define: Any) -> dict[str, Any]:
        one: list[Any] = [{"type": "number"}, {"type": "string"}]
        return {"anyOf": [*one, {"type": "array", "items": {}}]}

    def _outside(self, array: Any) -> bool:
        low = self.above is not None and bool((array <= self.above).any())
        return low or (self.least is not None and bool((array < self.least).any()))


def _in_unit(value: Any, unit: str) -> Any:
    """Return numbers, or lists of them, as a text says them exactly."""
    if isinstance(value, list):
        return [_in_unit(each, unit) for each in value]
    return written(value, unit) if unit else value


def _in_si(raw: Raw, unit: str = "") -> Any:
    """Return numbers in SI of a number, a text with a unit, or lists of these."""
    if isinstance(raw, list):
        return [_in_si(each, unit) for each in raw]
    if unit and (not isinstance(raw, str) or unit_in(raw) != unit):
        raise expected(f"in {unit}, as in {EXAMPLES[DIMENSIONS[unit]]!r}", raw)
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise expected("a number, in SI or with a unit", raw)
    return parsed(raw) if isinstance(raw, str) else raw


def parsed(text: str) -> float:
    """Return a quantity of any dimension in SI; InputError if it is none.

    >>> parsed("5 cm"), parsed("40 ms")
    (0.05, 0.04)
    """
    return parse(text, _dimension(text))


def unit_in(text: str) -> str:
    """Return the unit in SI of what a quantity is of; InputError if it is none.

    >>> unit_in("5 cm"), unit_in("90 deg")
    ('m', 'rad')
    """
    return SI[_dimension(text)]


def _dimension(text: str) -> Dimension:
    for dimension in get_args(Dimension):
        with suppress(UnitError):
            parse(text, dimension)
            return cast(Dimension, dimension)
    raise InputError(f'{said(text)}: expected a number with a unit, as in "5 cm" or "90 deg"')
