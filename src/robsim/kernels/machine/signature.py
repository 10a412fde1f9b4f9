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

from robsim.kernels.machine.block_rows import Address, BlockRows

_SYMBOL = re.compile(r"[A-Za-z]\w*")
_MULTIPLE = re.compile(r"(?:(\d+)\*)?([A-Za-z]\w*)")
_UNFIT = (AttributeError, IndexError, TypeError, ValueError)  # what looking at a wrong value raises
_MISSING = object()


class WrongRows(TypeError):
    """A stage is given what it does not take."""


class RowShape:
    """Rows, or a table in memory, of a shape that may name counts."""

    def __init__(self, text: str, kind: type[BlockRows] | type[Address] = BlockRows) -> None:
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

    def expected(self, counts: dict[str, int]) -> str:
        """Return the shape in words, with counts that are known."""
        what = "rows" if self.kind is BlockRows else "the address of an array"
        some = {name: counts[name] for name in _SYMBOL.findall(self.text) if name in counts}
        known = ", ".join(f"{name} = {n}" for name, n in some.items())
        return (
            f"{'a row' if not self.dims else f'{what} ({self.text})'}"
            f"{f' where {known}' if known else ''}{' or None' if self.may_be_absent else ''}"
        )

    def test(self, name: str) -> str:
        """Return the expression that says whether what is given fits."""
        shape = f"({', '.join(self.dims)}{',' if self.dims else ''})"
        same = f"{name}.__class__ is {self.kind.__name__} and {name}.shape == {shape}"
        return f"({name} is None or {same})" if self.may_be_absent else same

    def value(self, name: str) -> str:
        """Return the expression of the whole number that stands for what is given."""
        return f"-1 if {name} is None else {name}" if self.may_be_absent else name


class WholeNumber:
    """A whole number."""

    found: ClassVar[dict[str, tuple[int, int]]] = {}
    may_be_absent = False

    def expected(self, counts: dict[str, int]) -> str:
        """Return what is expected, in words."""
        return "a whole number"

    def test(self, name: str) -> str:
        """Return the expression that says whether what is given fits."""
        return f"({name}.__class__ is int or is_whole({name}))"

    def value(self, name: str) -> str:
        """Return the expression of the whole number that stands for what is given."""
        return f"int({name})"


def is_whole(value: Any) -> bool:
    """Return whether a value is a whole number, and no rows."""
    whole = isinstance(value, int | np.integer | np.bool_)
    return whole and not isinstance(value, BlockRows | Address)


class DeclaredFields:
    """Values with names, of which each is declared: of a stage, or of each record of a list.

    What is given is checked, and made into whole numbers, by code that is written in Python and
    compiled, since programs are put together for every run.
    """

    def __init__(self, texts: dict[str, str]) -> None:
        self.kinds = {name: _parse_declaration(text) for name, text in texts.items()}
        found = {count for kind in self.kinds.values() for count in kind.found}
        self.given = [name for name, text in texts.items() if text != "count" or name not in found]
        named: tuple[Any, ...] = (BlockRows, Address, is_whole)
        self.known = {each.__name__: each for each in named}
        self.known |= {f"_{name}": kind for name, kind in self.kinds.items()}

    def counted(self) -> list[str]:
        """Return the lines that find counts from shapes."""
        lines: dict[str, str] = {}
        for name, kind in self.kinds.items():
            for count, (axis, times) in kind.found.items():
                divided = f" // {times}" if times > 1 else ""
                lines.setdefault(count, f"{count} = {name}.shape[{axis}]{divided}")
        return [line for count, line in lines.items() if count not in self.given]

    def compiled(self, name: str, code: list[str], **more: Any) -> Any:
        """Return a function that is written in Python and knows the kinds by their names."""
        known = {**self.known, **more}
        exec("\n".join(code), known)
        return known[name]


class RecordList(DeclaredFields):
    """A list of records, each a tuple of the fields but counts, or of values of a single kind."""

    found: ClassVar[dict[str, tuple[int, int]]] = {}
    may_be_absent = False

    def __init__(self, text: str) -> None:
        self.alone = "=" not in text
        named = (
            [("entry", "=", text)] if self.alone else [f.partition("=") for f in text.split(";")]
        )
        super().__init__({name.strip(): kind.strip() for name, _, kind in named})

    def expected(self, counts: dict[str, int]) -> str:
        """Return what is expected, in words."""
        if self.alone:
            return f"a list, each {self.kinds['entry'].expected(counts)}"
        each = [f"{name} {self.kinds[name].expected(counts)}" for name in self.given]
        return f"a list of tuples ({'; '.join(each)})"

    def test(self, name: str) -> str:
        """Return the expression that says whether what is given fits."""
        return f"_{name}.encode({name}) is not None"

    def value(self, name: str) -> str:
        """Return the expression of the whole numbers that stand for what is given."""
        return f"*_{name}.encode({name})"

    @cached_property
    def encode(self) -> Callable[[Any], list[int] | None]:
        """A function that returns the length and the numbers of entries; None for a misfit."""
        entry = "entry" if self.alone else f"({', '.join(self.given)},)"
        tests = " and ".join(self.kinds[name].test(name) for name in self.given)
        values = ", ".join(kind.value(name) for name, kind in self.kinds.items())
        code = ["def encode(value):", " found_ = [len(value)]", f" for {entry} in value:"]
        code += [
            *(f"  {line}" for line in self.counted()),
            f"  if not ({tests}):",
            "   return None",
        ]
        code += [f"  found_ += [{values}]", " return found_"]
        return self.compiled("encode", code)  # type: ignore[no-any-return]


DeclaredKind = RowShape | WholeNumber | RecordList


def _parse_declaration(text: str) -> DeclaredKind:
    """Return what a declaration says."""
    if text in ("count", "whole"):
        return WholeNumber()
    if text.startswith("each:"):
        return RecordList(text.removeprefix("each:").strip())
    if text.startswith("table:"):
        return RowShape(text.removeprefix("table:"), Address)
    return RowShape(text)


class StageSignature(DeclaredFields):
    """The parameters of a stage, beside the block and the number of the step."""

    def __init__(self, name: str, function: Callable[..., Any]) -> None:
        _, _, *given = inspect.signature(function).parameters.values()
        super().__init__({each.name: each.default for each in given})
        self.name = name
        self.lists = [each for each, kind in self.kinds.items() if isinstance(kind, RecordList)]

    @cached_property
    def pack(self) -> Callable[..., list[int]]:
        """A function that checks what is given by name, and returns it as whole numbers.

        WrongRows: it does not fit.
        """
        absent = {n: "None" if self.kinds[n].may_be_absent else "missing" for n in self.given}
        heads = [*(f"{name}={default}" for name, default in absent.items()), "**others_"]
        tests = [self.kinds[n].test(n) for n in self.given if n not in self.lists]
        values = ("0" if n in self.lists else k.value(n) for n, k in self.kinds.items())
        code = [f"def pack({', '.join(heads)}):", " try:"]
        code += [f"  {line}" for line in self.counted()]
        code += [f"  if {' and '.join(['not others_', *tests])}:"]
        code += [f"   packed_ = [{', '.join(values)}]"]
        for name in self.lists:  # None, for one that does not fit, is nothing that can be added
            code += [f"   packed_[{list(self.kinds).index(name)}] = len(packed_)"]
            code += [f"   packed_ += _{name}.encode({name})"]
        code += ["   return packed_", " except unfit:", "  pass"]
        rows = [*(f"{name!r}: {name}" for name in self.given), "**others_"]
        code += [f" refuse({{{', '.join(rows)}}})"]
        known = {"unfit": _UNFIT, "missing": _MISSING, "refuse": self._refuse}
        return self.compiled("pack", code, **known)  # type: ignore[no-any-return]

    @property
    def wrapper(self) -> str:
        """The function (p, w, step) that calls the stage with the numbers that p holds."""
        numbers = (
            f"rest(p, p[{i}])" if name in self.lists else f"p[{i}]"
            for i, name in enumerate(self.kinds)
        )
        return f"def wrapper(p, w, step):\n    body({', '.join(['w', 'step', *numbers])})\n"

    def _refuse(self, rows: dict[str, Any]) -> NoReturn:
        """Raise WrongRows for the first parameter that is not what the stage takes."""
        named = {name: value for name, value in rows.items() if value is not _MISSING}
        needed = {name for name in self.given if not self.kinds[name].may_be_absent}
        if not needed <= named.keys() <= set(self.given):
            given = ", ".join(name for name, value in named.items() if value is not None)
            takes = f"takes {', '.join(self.given) or 'nothing'}"
            raise WrongRows(f"stage '{self.name}' {takes}; it was given {given or 'nothing'}")
        counts = {name: named[name] for name in named if isinstance(self.kinds[name], WholeNumber)}
        for name in [*named, *named]:  # once more with all counts
            known = dict(counts)
            if not self._fits(name, named, counts):
                expected = self.kinds[name].expected(known)
                raise WrongRows(
                    f"stage '{self.name}': {name} takes {expected}, got {named[name]!r}"
                )
        raise WrongRows(f"stage '{self.name}' cannot take {named}")

    def _fits(self, name: str, rows: dict[str, Any], counts: dict[str, int]) -> bool:
        """Return whether one value fits the counts that are known; those that it has are found."""
        kind = self.kinds[name]
        try:
            for count, (axis, times) in kind.found.items():
                counts.setdefault(count, rows[name].shape[axis] // times)
            return bool(eval(kind.test(name), {**self.known, **counts, **rows}))
        except NameError:  # of a count that is found later
            return True
        except _UNFIT:
            return False
