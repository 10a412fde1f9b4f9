"""Signatures of stages. The default of each parameter declares the kind of its argument.

- "N, 2": rows of this shape. "row" declares a single row.
- "2*N or none": rows of this shape, or None. The stage receives -1 for None.
- "count": a whole number that shapes refer to, computed from an axis N or 2*N.
- "whole": any whole number, or True or False.
- "table: times, n": the address of an array of this shape.
- "each: row": a list. The stage receives an array of its length and entries.
- "each: T=3, 4; x=row; turns=whole": a list of records, each a tuple of these fields.

Rows are passed by name. They are checked once, when a program is assembled.
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
_UNFIT = (AttributeError, IndexError, TypeError, ValueError)  # errors that a wrong value may raise
_MISSING = object()


class WrongRows(TypeError):
    """The arguments of a stage do not fit its signature."""


class RowShape:
    """Rows, or the address of an array, of a declared shape. The shape may refer to counts."""

    def __init__(self, text: str, kind: type[BlockRows] | type[Address] = BlockRows) -> None:
        text, *rest = text.split(" or ")
        self.may_be_absent = rest == ["none"]
        self.kind, self.text = kind, text.strip()
        self.dims = [] if self.text == "row" else [dim.strip() for dim in self.text.split(",")]

    @cached_property
    def count_axes(self) -> dict[str, tuple[int, int]]:
        """The axis and the factor of each count that can be computed from this shape."""
        each = ((i, _MULTIPLE.fullmatch(dim)) for i, dim in enumerate(self.dims))
        axes = {match[2]: (i, int(match[1] or 1)) for i, match in each if match}
        return {} if self.may_be_absent else axes

    def describe_expected(self, counts: dict[str, int]) -> str:
        """Return a description of the shape, with the values of known counts."""
        noun = "rows" if self.kind is BlockRows else "the address of an array"
        known = {name: counts[name] for name in _SYMBOL.findall(self.text) if name in counts}
        values = ", ".join(f"{name} = {n}" for name, n in known.items())
        return (
            f"{'a row' if not self.dims else f'{noun} ({self.text})'}"
            f"{f' where {values}' if values else ''}{' or None' if self.may_be_absent else ''}"
        )

    def test(self, name: str) -> str:
        """Return the expression that is true if the argument fits."""
        shape = f"({', '.join(self.dims)}{',' if self.dims else ''})"
        same = f"{name}.__class__ is {self.kind.__name__} and {name}.shape == {shape}"
        return f"({name} is None or {same})" if self.may_be_absent else same

    def value(self, name: str) -> str:
        """Return the expression that packs the argument into a whole number."""
        return f"-1 if {name} is None else {name}" if self.may_be_absent else name


class WholeNumber:
    """A whole number."""

    count_axes: ClassVar[dict[str, tuple[int, int]]] = {}
    may_be_absent = False

    def describe_expected(self, counts: dict[str, int]) -> str:
        """Return a description of the expected argument."""
        return "a whole number"

    def test(self, name: str) -> str:
        """Return the expression that is true if the argument fits."""
        return f"({name}.__class__ is int or is_whole({name}))"

    def value(self, name: str) -> str:
        """Return the expression that packs the argument into a whole number."""
        return f"int({name})"


def is_whole(value: Any) -> bool:
    """Return whether a value is a whole number and neither rows nor an address."""
    whole = isinstance(value, int | np.integer | np.bool_)
    return whole and not isinstance(value, BlockRows | Address)


class DeclaredFields:
    """Declared, named values: the parameters of a stage or the fields of a record.

    Generated Python code checks the arguments and packs them into whole numbers. Programs are
    assembled for every run, and generated code is faster than a loop over the declarations.
    """

    def __init__(self, texts: dict[str, str]) -> None:
        self.kinds = {name: _parse_declaration(text) for name, text in texts.items()}
        computed = {count for kind in self.kinds.values() for count in kind.count_axes}
        self.argument_names = [
            name for name, text in texts.items() if text != "count" or name not in computed
        ]
        functions: tuple[Any, ...] = (BlockRows, Address, is_whole)
        self.namespace = {each.__name__: each for each in functions}
        self.namespace |= {f"_{name}": kind for name, kind in self.kinds.items()}

    def count_lines(self) -> list[str]:
        """Return the code lines that compute counts from shapes."""
        lines: dict[str, str] = {}
        for name, kind in self.kinds.items():
            for count, (axis, times) in kind.count_axes.items():
                divided = f" // {times}" if times > 1 else ""
                lines.setdefault(count, f"{count} = {name}.shape[{axis}]{divided}")
        return [line for count, line in lines.items() if count not in self.argument_names]

    def compile_function(self, name: str, code: list[str], **more: Any) -> Any:
        """Return the function `name` of generated code that can refer to the declarations."""
        namespace = {**self.namespace, **more}
        exec("\n".join(code), namespace)
        return namespace[name]


class RecordList(DeclaredFields):
    """A list of records or of values of a single kind. A record is a tuple without the counts."""

    count_axes: ClassVar[dict[str, tuple[int, int]]] = {}
    may_be_absent = False

    def __init__(self, text: str) -> None:
        self.is_single = "=" not in text
        named = (
            [("entry", "=", text)]
            if self.is_single
            else [f.partition("=") for f in text.split(";")]
        )
        super().__init__({name.strip(): kind.strip() for name, _, kind in named})

    def describe_expected(self, counts: dict[str, int]) -> str:
        """Return a description of the expected list."""
        if self.is_single:
            return f"a list, each {self.kinds['entry'].describe_expected(counts)}"
        each = [
            f"{name} {self.kinds[name].describe_expected(counts)}" for name in self.argument_names
        ]
        return f"a list of tuples ({'; '.join(each)})"

    def test(self, name: str) -> str:
        """Return the expression that is true if the argument fits."""
        return f"_{name}.encode({name}) is not None"

    def value(self, name: str) -> str:
        """Return the expression that packs the argument into whole numbers."""
        return f"*_{name}.encode({name})"

    @cached_property
    def encode(self) -> Callable[[Any], list[int] | None]:
        """A function that returns the length and the packed entries, or None for a misfit."""
        entry = "entry" if self.is_single else f"({', '.join(self.argument_names)},)"
        tests = " and ".join(self.kinds[name].test(name) for name in self.argument_names)
        values = ", ".join(kind.value(name) for name, kind in self.kinds.items())
        code = ["def encode(value):", " found_ = [len(value)]", f" for {entry} in value:"]
        code += [
            *(f"  {line}" for line in self.count_lines()),
            f"  if not ({tests}):",
            "   return None",
        ]
        code += [f"  found_ += [{values}]", " return found_"]
        return self.compile_function("encode", code)  # type: ignore[no-any-return]


DeclaredKind = RowShape | WholeNumber | RecordList


def _parse_declaration(text: str) -> DeclaredKind:
    """Return the kind that a declaration describes."""
    if text in ("count", "whole"):
        return WholeNumber()
    if text.startswith("each:"):
        return RecordList(text.removeprefix("each:").strip())
    if text.startswith("table:"):
        return RowShape(text.removeprefix("table:"), Address)
    return RowShape(text)


class StageSignature(DeclaredFields):
    """The parameters of a stage after the block and the step number."""

    def __init__(self, name: str, function: Callable[..., Any]) -> None:
        _, _, *parameters = inspect.signature(function).parameters.values()
        super().__init__({each.name: each.default for each in parameters})
        self.name = name
        self.lists = [each for each, kind in self.kinds.items() if isinstance(kind, RecordList)]

    @cached_property
    def pack(self) -> Callable[..., list[int]]:
        """A function that checks arguments passed by name and packs them into whole numbers.

        It raises WrongRows if the arguments do not fit.
        """
        absent = {
            n: "None" if self.kinds[n].may_be_absent else "missing" for n in self.argument_names
        }
        heads = [*(f"{name}={default}" for name, default in absent.items()), "**others_"]
        tests = [self.kinds[n].test(n) for n in self.argument_names if n not in self.lists]
        values = ("0" if n in self.lists else k.value(n) for n, k in self.kinds.items())
        code = [f"def pack({', '.join(heads)}):", " try:"]
        code += [f"  {line}" for line in self.count_lines()]
        code += [f"  if {' and '.join(['not others_', *tests])}:"]
        code += [f"   packed_ = [{', '.join(values)}]"]
        for name in self.lists:  # `encode` returns None for a misfit, and += None raises TypeError
            code += [f"   packed_[{list(self.kinds).index(name)}] = len(packed_)"]
            code += [f"   packed_ += _{name}.encode({name})"]
        code += ["   return packed_", " except unfit:", "  pass"]
        rows = [*(f"{name!r}: {name}" for name in self.argument_names), "**others_"]
        code += [f" refuse({{{', '.join(rows)}}})"]
        more = {"unfit": _UNFIT, "missing": _MISSING, "refuse": self._refuse}
        return self.compile_function("pack", code, **more)  # type: ignore[no-any-return]

    @property
    def wrapper(self) -> str:
        """The code of a function (p, w, step) that calls the stage with the numbers in p."""
        numbers = (
            f"rest(p, p[{i}])" if name in self.lists else f"p[{i}]"
            for i, name in enumerate(self.kinds)
        )
        return f"def wrapper(p, w, step):\n    body({', '.join(['w', 'step', *numbers])})\n"

    def _refuse(self, rows: dict[str, Any]) -> NoReturn:
        """Raise WrongRows for the first argument that does not fit the signature."""
        passed = {name: value for name, value in rows.items() if value is not _MISSING}
        needed = {name for name in self.argument_names if not self.kinds[name].may_be_absent}
        if not needed <= passed.keys() <= set(self.argument_names):
            got = ", ".join(name for name, value in passed.items() if value is not None)
            takes = f"takes {', '.join(self.argument_names) or 'nothing'}"
            raise WrongRows(f"stage '{self.name}' {takes}; got {got or 'nothing'}")
        counts = {
            name: passed[name] for name in passed if isinstance(self.kinds[name], WholeNumber)
        }
        for name in [*passed, *passed]:  # the second pass has all counts
            known = dict(counts)
            if not self._fits(name, passed, counts):
                expected = self.kinds[name].describe_expected(known)
                raise WrongRows(
                    f"stage '{self.name}': {name} takes {expected}, got {passed[name]!r}"
                )
        raise WrongRows(f"stage '{self.name}' cannot take {passed}")

    def _fits(self, name: str, rows: dict[str, Any], counts: dict[str, int]) -> bool:
        """Return whether one argument fits, and add the counts of its shape to `counts`."""
        kind = self.kinds[name]
        try:
            for count, (axis, times) in kind.count_axes.items():
                counts.setdefault(count, rows[name].shape[axis] // times)
            return bool(eval(kind.test(name), {**self.namespace, **counts, **rows}))
        except NameError:  # a count that a later argument defines
            return True
        except _UNFIT:
            return False
