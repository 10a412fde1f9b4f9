"""What a stage takes: the parameters of its function, whose defaults declare what each of them is.

    "N, 2"            rows of that shape; "row" is a single one
    "2*N or none"     rows that may be absent: None, and -1 in the stage
    "count"           a whole number that shapes name, found from an axis that is N, or 2*N
    "whole"           any whole number, or True and False
    "table: times, n" the address of an array of that shape
    "each: row"       a list, in the stage an array: its length, and then its entries
    "each: T=3, 4; x=row; turns=whole" a list of records: a tuple of these for each

Rows are passed by name, and checked once, where a program is put together.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import cached_property
from typing import Any, ClassVar, NoReturn

import numpy as np

from robsim.kernels.machine.rows import Address, Rows

_SYMBOL = re.compile(r"[A-Za-z]\w*")
_MULTIPLE = re.compile(r"(?:(\d+)\*)?([A-Za-z]\w*)")


class WrongRows(TypeError):
    """A stage is given what it does not take."""


class Shape:
    """Rows, or a table in memory, of a shape that may name counts."""

    def __init__(self, text: str, kind: type[Rows] | type[Address] = Rows) -> None:
        text, *rest = text.split(" or ")
        self.may_be_absent = rest == ["none"]
        self.kind, self.text = kind, text.strip()
        self.dims = [] if self.text == "row" else [dim.strip() for dim in self.text.split(",")]

    @cached_property
    def found(self) -> dict[str, tuple[int, int]]:
        """The counts that are found from this shape: which axis is how many times each of them."""
        each = ((i, _MULTIPLE.fullmatch(dim)) for i, dim in enumerate(self.dims))
        axes = {match[2]: (i, int(match[1] or 1)) for i, match in each if match}
        return {} if self.may_be_absent else axes

    @property
    def code(self) -> str:
        """The shape as an expression of Python."""
        return f"({', '.join(self.dims)}{',' if self.dims else ''})"

    def expected(self, counts: dict[str, int]) -> str:
        """Return the shape in words, with counts that are known."""
        what = "rows" if self.kind is Rows else "the address of an array"
        some = {name: counts[name] for name in _SYMBOL.findall(self.text) if name in counts}
        known = ", ".join(f"{name} = {n}" for name, n in some.items())
        return (
            f"{'a row' if not self.dims else f'{what} ({self.text})'}"
            f"{f' where {known}' if known else ''}{' or None' if self.may_be_absent else ''}"
        )

    def fits(self, value: Any, counts: dict[str, int]) -> bool:
        """Return whether a value has this shape; counts that are not known yet are found."""
        if value is None:
            return self.may_be_absent
        if type(value) is not self.kind or len(value.shape) != len(self.dims):
            return False
        for name, (axis, times) in self.found.items():
            counts.setdefault(name, value.shape[axis] // times)
        return all(
            length == eval(dim, {"__builtins__": {}}, dict(counts))
            for dim, length in zip(self.dims, value.shape, strict=True)
            if set(_SYMBOL.findall(dim)) <= counts.keys()
        )

    def encode(self, value: Any) -> list[int]:
        """Return the whole numbers that stand for a value."""
        return [-1 if value is None else value]


class Whole:
    """A whole number."""

    found: ClassVar[dict[str, tuple[int, int]]] = {}

    def expected(self, counts: dict[str, int]) -> str:
        """Return what is expected, in words."""
        return "a whole number"

    def fits(self, value: Any, counts: dict[str, int]) -> bool:
        """Return whether a value is one, and no rows."""
        whole = isinstance(value, int | np.integer | np.bool_)
        return whole and not isinstance(value, Rows | Address)

    def encode(self, value: Any) -> list[int]:
        """Return the whole numbers that stand for a value."""
        return [int(value)]


class Each:
    """A list of records, each a tuple of the fields but counts, or of values of a single kind."""

    found: ClassVar[dict[str, tuple[int, int]]] = {}

    def __init__(self, text: str) -> None:
        named = [field.partition("=") for field in text.split(";")] if "=" in text else []
        self.alone = not named
        self.fields = {name.strip(): kind.strip() for name, _, kind in named} or {"": text}
        self.kinds = {name: _kind(kind) for name, kind in self.fields.items()}
        self.given = [name for name, kind in self.fields.items() if kind != "count"]

    def expected(self, counts: dict[str, int]) -> str:
        """Return what is expected, in words."""
        each = [f"{name} {self.kinds[name].expected(counts)}".strip() for name in self.given]
        return f"a list, each {each[0]}" if self.alone else f"a list of tuples ({'; '.join(each)})"

    def fits(self, value: Any, counts: dict[str, int]) -> bool:
        """Return whether a value is such a list."""
        if isinstance(value, Rows | str) or not hasattr(value, "__len__"):
            return False
        return all(self._found(record, counts) is not None for record in value)

    def _found(self, record: Any, counts: dict[str, int]) -> dict[str, Any] | None:
        """Return the values of a record and its counts by their names; None if it does not fit."""
        values, own = (record,) if self.alone else record, dict(counts)
        if not isinstance(values, tuple) or len(values) != len(self.given):
            return None
        found = dict(zip(self.given, values, strict=True))
        fits = all(self.kinds[name].fits(value, own) for name, value in found.items())
        return {**own, **found} if fits else None

    def encode(self, value: Any) -> list[int]:
        """Return the length, and the whole numbers that stand for the entries."""
        found = [len(value)]
        for record in value:
            values = self._found(record, {}) or {}
            for name, kind in self.kinds.items():
                found += kind.encode(values[name])
        return found


Kind = Shape | Whole | Each


def _kind(text: str) -> Kind:
    """Return what a declaration says."""
    text = text.strip()
    if text in ("count", "whole"):
        return Whole()
    if text.startswith("each:"):
        return Each(text.removeprefix("each:"))
    if text.startswith("table:"):
        return Shape(text.removeprefix("table:"), Address)
    return Shape(text)


class Signature:
    """The parameters of a stage, beside the block and the number of the step."""

    def __init__(self, name: str, function: Callable[..., Any]) -> None:
        _, _, *given = inspect.signature(function).parameters.values()
        self.name = name
        self.texts = {each.name: each.default for each in given}
        self.kinds: dict[str, Kind] = {each: _kind(text) for each, text in self.texts.items()}
        found = {count for kind in self.kinds.values() for count in kind.found}
        self.counts = {each for each, text in self.texts.items() if text == "count"}
        self.given = [each for each in self.kinds if each not in self.counts & found]
        self.lists = [each for each, kind in self.kinds.items() if isinstance(kind, Each)]
        self._pack = self._packing()

    def pack(self, **rows: Any) -> list[int]:
        """Return the whole numbers that stand for what is given; WrongRows if it does not fit."""
        try:
            return self._pack(**rows)
        except WrongRows:
            raise
        except TypeError:  # of a function that is called with other names
            given = ", ".join(rows) or "nothing"
            takes = f"takes {', '.join(self.given) or 'nothing'}"
            raise WrongRows(f"stage '{self.name}' {takes}; it was given {given}") from None

    @property
    def wrapper(self) -> str:
        """The function (p, w, step) that calls the stage with the numbers that p holds."""
        numbers = (
            f"rest(p, p[{i}])" if name in self.lists else f"p[{i}]"
            for i, name in enumerate(self.kinds)
        )
        return f"def wrapper(p, w, step):\n    body({', '.join(['w', 'step', *numbers])})\n"

    def _packing(self) -> Callable[..., list[int]]:
        """Return a function that checks what is given by name, and returns it as whole numbers.

        It is written in Python and compiled, since programs are put together for every run.
        """
        code = [f"def pack({self._heads()}):", " try:"]
        code += [f"  {line}" for line in self._unpacked()]
        code += [f"  fits_ = {' and '.join(map(self._test, self.given)) or 'True'}"]
        code += [" except (AttributeError, IndexError, TypeError):", "  fits_ = False"]
        code += [" if not fits_:", f"  wrong(dict({', '.join(f'{n}={n}' for n in self.given)}))"]
        code += [f" packed_ = [{', '.join(map(self._value, self.kinds))}]"]
        for name in self.lists:
            code += [f" packed_[{list(self.kinds).index(name)}] = len(packed_)"]
            code += [f" packed_ += _{name}.encode({name})"]
        known: dict[str, Any] = {"Rows": Rows, "Address": Address, "wrong": self._refuse}
        known |= {f"_{name}": kind for name, kind in self.kinds.items()}
        exec("\n".join([*code, " return packed_"]), known)
        pack: Callable[..., list[int]] = known["pack"]
        return pack

    def _heads(self) -> str:
        """Return the parameters of the function that packs, those that may be absent last."""
        absent = [name for name in self.given if self._may_be_absent(name)]
        heads = [*(n for n in self.given if n not in absent), *(f"{n}=None" for n in absent)]
        return f"*, {', '.join(heads)}" if heads else ""

    def _unpacked(self) -> list[str]:
        """Return the lines that find counts from shapes."""
        lines, known = [], {name for name in self.given if name in self.counts}
        for name, kind in self.kinds.items():
            for count, (axis, times) in kind.found.items():
                if count not in known:
                    known.add(count)
                    lines.append(f"{count} = {name}.shape[{axis}]{f' // {times}' * (times > 1)}")
        return lines

    def _test(self, name: str) -> str:
        kind = self.kinds[name]
        if not isinstance(kind, Shape):
            return f"_{name}.fits({name}, {{}})"
        same = f"{name}.__class__ is {kind.kind.__name__} and {name}.shape == {kind.code}"
        return f"({name} is None or {same})" if kind.may_be_absent else same

    def _value(self, name: str) -> str:
        if name in self.lists:
            return "0"
        return f"-1 if {name} is None else {name}" if self._may_be_absent(name) else name

    def _may_be_absent(self, name: str) -> bool:
        kind = self.kinds[name]
        return isinstance(kind, Shape) and kind.may_be_absent

    def _refuse(self, given: dict[str, Any]) -> NoReturn:
        """Raise WrongRows for the first parameter that is not what the stage takes."""
        counts = {name: given[name] for name in self.counts & given.keys()}
        for name in [*given, *given]:  # once more with all counts
            kind, value = self.kinds[name], given[name]
            if not kind.fits(value, counts):
                raise WrongRows(
                    f"stage '{self.name}': {name} takes {kind.expected(counts)}, got {value!r}"
                )
        raise WrongRows(f"stage '{self.name}' cannot take {given}")
