"""Numbers whose unit only their place tells, or several of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

from robsim.base.arrays import frozen, numbers
from robsim.base.errors import InputError, UnitError, said
from robsim.base.units import Dimension, parse
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

    def check(self, value: Any, what: str) -> Any:
        array = numbers(value, what, () if self.count is None else (self.count,))
        if isinstance(value, bool) or array.ndim > 2 or not array.size or self._outside(array):
            raise InputError(f"{what}: expected {self.words()}, got {said(value)}")
        return frozen(array)

    def read(self, raw: Raw, c: Context) -> Any:
        array = numbers(_in_si(raw), str(c.path[-1]) if c.path else "value", ())
        if (self.count is not None and array.shape[-1:] != (self.count,)) or self._outside(array):
            raise expected(self.words(), raw)
        return frozen(array)

    def write(self, value: Any, c: Context) -> Any:
        return value.tolist()

    def words(self) -> str:
        bound = "above 0" if self.above == 0 else "not below 0" if self.least == 0 else ""
        if self.count is not None:
            return f"{self.count} numbers {bound}".rstrip() + ", in SI or with a unit"
        return f"a number {bound}".rstrip() + ', in SI or with a unit ("5 cm"), or a list of these'

    def schema(self, define: Any) -> dict[str, Any]:
        one: list[Any] = [{"type": "number"}, {"type": "string"}]
        return {"anyOf": [*one, {"type": "array", "items": {}}]}

    def wrong(self) -> Sequence[Raw]:
        return ["fast", "5 parsecs", True, ["x"], [[1.0], [1.0, 2.0]]]

    def _outside(self, array: Any) -> bool:
        low = self.above is not None and bool((array <= self.above).any())
        return low or (self.least is not None and bool((array < self.least).any()))


def _in_si(raw: Raw) -> Any:
    """Return numbers in SI of a number, a text with a unit, or lists of these."""
    if isinstance(raw, list):
        return [_in_si(each) for each in raw]
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise expected("a number, in SI or with a unit", raw)
    return parsed(raw) if isinstance(raw, str) else raw


def parsed(text: str) -> float:
    """Return a quantity of any dimension in SI; InputError if it is none.

    >>> parsed("5 cm"), parsed("40 ms")
    (0.05, 0.04)
    """
    for dimension in get_args(Dimension):
        try:
            return parse(text, dimension)
        except UnitError:
            continue
    raise InputError(f'{said(text)}: expected a number with a unit, as in "5 cm" or "90 deg"')
