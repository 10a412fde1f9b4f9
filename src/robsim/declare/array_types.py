"""Arrays of numbers, written as lists in a text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.problems import prefix_path
from robsim.declare.scalars import ANY, Number, PlainValue
from robsim.declare.spec import DefineSchema, JSONSchema, make_expected_error


@dataclass(frozen=True, kw_only=True)
class Numbers(PlainValue):
    """Array of numbers, each declared by `item`, written as a list or as rows.

    A word in `shape` stands for any size. If `shape` is None, a single number or an array of any
    shape is valid.
    """

    item: Number = ANY
    shape: tuple[int | str, ...] | None = ("n",)

    forms: ClassVar[tuple[str, ...]] = ("list",)

    def find_violation(self, value: FieldValue) -> str:
        deepest = 2 if self.shape is None else len(self.shape)
        each = value.ravel().tolist() if self.item.limits else []
        wrong = value.ndim > deepest or not value.size or any(map(self.item.find_violation, each))
        return self.text_words() if wrong else ""

    def convert_python_value(self, value: FieldValue, what: str) -> FieldValue:
        return make_read_only(as_floats(value, what, self.shape or ()))

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        nested = self._each(raw, self.item.read, c)
        try:
            return self.convert_python_value(nested, "")
        except InputError:
            raise make_expected_error(self.text_words(), raw) from None

    def write(self, value: object, c: Context) -> FieldValue:
        return self._each(np.asarray(value).tolist(), self.item.write, c)

    def words(self) -> str:
        return self._describe_list(self.item.words())

    def text_words(self) -> str:
        return self._describe_list(self.item.text_words())

    def rows(self, name: str) -> list[tuple[str, str]]:
        return [(key, self._describe_list(holds)) for key, holds in self.item.rows(name)]

    def schema(self, define: DefineSchema) -> JSONSchema:
        one = self.item.schema(define)
        if self.json:
            return dict(self.json)
        if self.shape is None:
            return {"anyOf": [one, {"type": "array"}]}
        return reduce(lambda items, _: {"type": "array", "items": items}, self.shape, one)

    def _describe_list(self, words: str) -> str:
        """Return a phrase for an array of numbers that are described by `words`."""
        if self.shape is None:
            return f"{words}, or a list of these"
        *rows, count = self.shape
        if rows:
            of = "rows of one length" if isinstance(count, str) else f"{count} columns"
            return f"a matrix of {of}"
        return f"a list of {'one or more' if isinstance(count, str) else count}: {words}"

    def _each(self, raw: Raw, change: Callable[[Any, Context], Any], c: Context) -> Any:
        """Return nested lists with `change` applied to each number."""
        if not isinstance(raw, list):
            return change(raw, c)
        changed = []
        for i, each in enumerate(raw):
            with prefix_path(i):
                changed.append(self._each(each, change, c))
        return changed
