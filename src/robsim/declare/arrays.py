"""Arrays of bare numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from robsim.base.arrays import frozen, numbers
from robsim.base.errors import InputError
from robsim.declare.lists import ListOf
from robsim.declare.scalars import Number
from robsim.declare.spec import Context, Raw, Spec

MOST = 10_000  # numbers of a list


@dataclass(frozen=True)
class Row(Spec):
    """A list of numbers, which becomes an array (n,)."""

    form: ClassVar[str] = "list"

    def check(self, value: Any, what: str) -> Any:
        array = numbers(value, what, ("n",))
        if array.ndim != 1 or not array.size:
            raise InputError(f"{what}: expected shape (n,), got {array.shape}")
        return frozen(array)

    def read(self, raw: Raw, c: Context) -> tuple[float, ...]:
        return ListOf(Number(), 1, MOST).read(raw, c)

    def write(self, value: Any, c: Context) -> list[float]:
        return [float(x) for x in value]

    def words(self) -> str:
        return "a list of numbers"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "array", "items": {"type": "number"}, "minItems": 1}


@dataclass(frozen=True)
class Matrix(Spec):
    """A list of rows of one length, which becomes an array (rows, columns)."""

    columns: int | None = None
    form: ClassVar[str] = "list"

    def check(self, value: Any, what: str) -> Any:
        array = numbers(value, what, ("k", "n" if self.columns is None else self.columns))
        if array.ndim != 2 or not array.size:
            raise InputError(f"{what}: expected {self.words()}, got shape {array.shape}")
        return frozen(array)

    def read(self, raw: Raw, c: Context) -> Any:
        row = ListOf(Number(), self.columns or 1, self.columns or MOST)
        rows = ListOf(row, 1, MOST).read(raw, c)
        if len({len(each) for each in rows}) > 1:
            raise InputError(f"rows of unequal lengths {sorted({len(each) for each in rows})}")
        return rows

    def write(self, value: Any, c: Context) -> list[list[float]]:
        return [[float(x) for x in row] for row in value]

    def words(self) -> str:
        return f"a matrix of {self.columns} columns" if self.columns else "a matrix"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "array", "items": {"type": "array", "items": {"type": "number"}}}
