"""Lists of the values that a name may have: numbers, texts as in a file, tables, or objects."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import is_listed
from robsim.base.errors import InputError, said
from robsim.base.values import hashable
from robsim.declare.spec import Context, NoText, Raw, Spec, expected

MOST = 10_000


def check_values(value: Any, what: str, *, twice: bool = False) -> tuple[Any, ...]:
    """Return values as a tuple; InputError if there are none, or one twice where it may not be."""
    listed = is_listed(value) and isinstance(value, Sized) and not isinstance(value, dict)
    if not listed or not 1 <= len(value) <= MOST:
        raise InputError(f"{what}: expected a list of 1 to {MOST} values, got {said(value)}")
    made = tuple(each.item() if isinstance(each, np.generic) else each for each in value)
    for each in made:
        if isinstance(each, float) and not np.isfinite(each):
            raise InputError(f"{what}: {each} is not finite")
    for i, each in enumerate(() if twice else made):
        if any(_same(each, other) for other in made[:i]):
            raise InputError(f"{what}: {said(each)} is there twice")
    return made


def _same(a: Any, b: Any) -> bool:
    return type(a) is type(b) and bool(hashable(a) == hashable(b))


@dataclass(frozen=True)
class ValuesSpec(Spec):
    """A list of values of any kind, as the varied name takes them."""

    form: ClassVar[str] = "list"

    def check(self, value: Any, what: str) -> tuple[Any, ...]:
        return check_values(value, what)

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        if not isinstance(raw, list):
            raise expected(self.words(), raw)
        return check_values(raw, "values")

    def write(self, value: Any, c: Context) -> list[Raw]:
        for each in value:
            if not isinstance(each, bool | int | float | str | list | dict):
                raise NoText(f"{type(each).__name__} is an object")
        return list(value)

    def words(self) -> str:
        return "a list of values"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "array", "minItems": 1, "maxItems": MOST}

    def wrong(self) -> Sequence[Raw]:
        return [3, "x", []]
