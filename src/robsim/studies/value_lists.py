"""Lists of the values that a name may have: numbers, texts as in a file, tables, or objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import has_items
from robsim.base.errors import InputError, format_value
from robsim.base.value import make_hashable
from robsim.declare.spec import Context, Raw, Spec

MOST_VALUES = 10_000


def check_values(value: Any, what: str, *, twice: bool = False) -> tuple[Any, ...]:
    """Return values as a tuple; InputError if there are none, or one twice where it may not be."""
    listed = isinstance(value, Sequence | np.ndarray) and has_items(value)
    if not listed or not 1 <= len(value) <= MOST_VALUES:
        raise InputError(
            f"{what}: expected a list of 1 to {MOST_VALUES} values, got {format_value(value)}"
        )
    made = tuple(each.item() if isinstance(each, np.generic) else each for each in value)
    for each in made:
        if isinstance(each, float) and not np.isfinite(each):
            raise InputError(f"{what}: {each} is not finite")
    seen = set()
    for each in () if twice else made:
        key = (type(each), repr(each) if isinstance(each, list | dict) else make_hashable(each))
        if key in seen:
            raise InputError(f"{what}: {format_value(each)} is there twice")
        seen.add(key)
    return made


def is_toml_value(value: Any) -> bool:
    """Return whether a text says a value as it is."""
    if isinstance(value, list):
        return all(map(is_toml_value, value))
    if isinstance(value, dict):
        return all(map(is_toml_value, value.values()))
    return isinstance(value, bool | int | float | str)


@dataclass(frozen=True)
class ValuesSpec(Spec):
    """A list of values of any kind, as the varied name takes them."""

    form: ClassVar[str] = "list"
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
