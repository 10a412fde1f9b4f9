"""Lists of values of a varied name: numbers, TOML texts, tables, or objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import has_items
from robsim.base.errors import InputError, format_value
from robsim.base.value import make_hashable
from robsim.declare.context import Context, Raw
from robsim.declare.spec import Spec

MOST_VALUES = 10_000

# values of a varied name, or values by label
Values = Sequence[object] | Mapping[str, object] | NDArray[np.generic]


def check_values(value: Any, subject: str, *, twice: bool = False) -> tuple[Any, ...]:
    """Return values as a tuple.

    Raises InputError if there are none, or if a value occurs twice and `twice` is false.
    """
    listed = isinstance(value, Sequence | np.ndarray) and has_items(value)
    if not listed or not 1 <= len(value) <= MOST_VALUES:
        raise InputError(
            f"{subject}: expected a list of 1 to {MOST_VALUES} values, got {format_value(value)}"
        )
    checked = tuple(each.item() if isinstance(each, np.generic) else each for each in value)
    for each in checked:
        if isinstance(each, float) and not np.isfinite(each):
            raise InputError(f"{subject}: {each} is not finite")
    keys = set()
    for each in () if twice else checked:
        key = (type(each), repr(each) if isinstance(each, list | dict) else make_hashable(each))
        if key in keys:
            raise InputError(f"{subject}: {format_value(each)} occurs twice")
        keys.add(key)
    return checked


def is_toml_value(value: Any) -> bool:
    """Return whether a value can be written to TOML as it is."""
    if isinstance(value, list):
        return all(map(is_toml_value, value))
    if isinstance(value, dict):
        return all(map(is_toml_value, value.values()))
    return isinstance(value, bool | int | float | str)


@dataclass(frozen=True)
class ValuesSpec(Spec):
    """A list of values of any kind that the varied name accepts."""

    forms: ClassVar[tuple[str, ...]] = ("list",)
    phrase: ClassVar[str] = "a list of values"

    def check(self, value: Any, what: str) -> tuple[Any, ...]:
        if isinstance(value, dict):
            value = [{"label": label, "value": each} for label, each in value.items()]
        return check_values(value, what)

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        return check_values(raw, "values")

    def write(self, value: Any, c: Context) -> list[Raw]:
        return list(value)

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "array", "minItems": 1, "maxItems": MOST_VALUES}
