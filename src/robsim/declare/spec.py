"""The specification of what a declared field may hold: checked, read and written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError, format_value
from robsim.declare.problems import Problems, UnreadableValue, join_keys

Raw = Any  # what a TOML text holds: tables, lists, texts, numbers, truth values


class NoTextError(Exception):
    """The error about a value made of a user's Python code, which no text can hold."""


class _Missing:
    """The mark of a field without a value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING: Any = _Missing()


@dataclass(frozen=True)
class PythonValue:
    """A value that Python code gives in a table, as it is, and a table of changes of it."""

    value: Any
    changes: Mapping[str, Raw] | None = None


def is_numeric(value: Any) -> bool:
    """Return whether a value is a number, or a list of numbers, also within lists."""
    if isinstance(value, list):
        return all(map(is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclass(frozen=True)
class Context:
    """The place of a value in a text, and the facts that are known there.

    `facts` come from outer tables, such as the scene whose joints give numbers their units.
    `over` is the value before, where a text changes one: `Spec.read` then takes from it all that
    the text leaves as it is, and `Spec.write` leaves out all that is the same. It is of this place
    alone.
    """

    problems: Problems
    path: tuple[str | int, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    over: Any = MISSING

    def at(self, *keys: str | int, over: Any = MISSING) -> Context:
        """Return the context of a value inside."""
        return Context(self.problems, (*self.path, *keys), self.facts, over)

    def changing(self, old: Any) -> Context:
        """Return the context of a change of an old value."""
        return Context(self.problems, self.path, self.facts, old)

    def knowing(self, **facts: Any) -> Context:
        """Return the same place with more facts."""
        return Context(self.problems, self.path, {**self.facts, **facts}, self.over)

    def report(self, text: str) -> None:
        """Add a problem of the value here."""
        self.problems.add(join_keys(*self.path), text)

    def blame(self, error: InputError) -> None:
        """Add an error about the value here, or about a value inside."""
        self.problems.add(join_keys(*self.path, error.path), error.text)

    def tried(self, spec: Spec, raw: Raw) -> Any:
        """Return the value that `raw` says, or MISSING with its problem reported."""
        try:
            if not isinstance(raw, PythonValue):
                return spec.read(raw, self)
            value = self._checked(spec, raw.value)
            return value if raw.changes is None else spec.read(raw.changes, self.changing(value))
        except (
            UnreadableValue
        ):  # for a problem that is reported elsewhere: nothing is made of the rest
            self.problems.seen += 1
        except FileError:
            raise
        except InputError as error:
            self.blame(error)
        return MISSING

    def _checked(self, spec: Spec, value: Any) -> Any:
        """Return a Python object as the field keeps it; plain values are those of a text.

        A number in SI stands for itself where a text has a unit.
        """
        if isinstance(value, np.generic | np.ndarray) and not np.ndim(value):
            value = value.item()
        united = spec.plain_spec.united and is_numeric(value)
        if isinstance(value, bool | int | float | list | dict | str) and not united:
            return spec.read(value, self)
        try:
            return spec.check(value, str(self.path[-1]) if self.path else "value")
        except (TypeError, ValueError, AttributeError, OverflowError) as error:
            if isinstance(error, InputError):
                raise
            raise make_python_error(spec, value) from None  # of an object that is no number


class UnwritableChange(Exception):
    """The signal that no table says how one value differs from another."""


class Spec:
    """The specification of what a declared field may hold.

    A field is written under its own name, unless `keys`, `pick` and `put` say otherwise.
    """

    form: ClassVar[str] = "plain"  # or "list", or "table": by which `OneOf` tells them apart
    forms: ClassVar[tuple[str, ...]] = ()  # where it is several
    takes_none: ClassVar[bool] = False  # whether None is checked as well, where it is the default
    united: ClassVar[bool] = False  # whether a text says it with a unit, and Python without
    phrase: ClassVar[str] = ""  # for what is expected, where it is always the same
    python_phrase: ClassVar[str] = ""  # for what Python code may give, likewise
    json: ClassVar[Mapping[str, Any]] = {}  # its JSON Schema, likewise

    def check(self, value: Any, what: str) -> Any:
        """Return the value as the object keeps it; InputError that names `what`."""
        return value

    def read(self, raw: Raw, c: Context) -> Any:
        """Return the value that a text says, over `c.over`; InputError with what would be valid."""
        raise NotImplementedError

    def write(self, value: Any, c: Context) -> Raw:
        """Return how a text says the value exactly, or how it differs from `c.over`.

        NoText: it cannot. Unsayable: no text says the difference.
        """
        raise NotImplementedError

    def words(self) -> str:
        """Return what is expected, as a phrase."""
        return self.phrase

    def accepts(self) -> str:
        """Return what Python code may give, as a phrase: what a text says, without its units."""
        return self.python_phrase or self.words().partition(", as in")[0]

    def text_words(self) -> str:
        """Return likewise what is expected in a text, where that is something else."""
        return self.words()

    def schema(self, define: Any) -> dict[str, Any]:
        """Return a JSON Schema; `define` gives the reference to that of a declared class."""
        return dict(self.json)

    def inside(self) -> Sequence[type[Any]]:
        """Return the declared classes whose tables may stand here."""
        return ()

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        """Return how a person may change a value at its `Place`; nothing where nobody can."""
        return ()

    @property
    def si_unit(self) -> str:
        """The unit in Python of the numbers here; "" where there is none."""
        return str(getattr(self, "unit", ""))

    @property
    def plain_spec(self) -> Spec:
        """What a number here must be."""
        return self

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        """Return the `Part`s of a value to which the first keys lead, which are taken away."""
        return []

    # a field among the keys of its table

    def keys(self, name: str) -> tuple[str, ...]:
        """Return the keys of the table that say this field."""
        return (name,)

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        """Return the keys within the value of the field to which one of its keys leads."""
        return () if key == name else (key,)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        """Return the value of the field from its table; MISSING if it is not there, or wrong."""
        return c.at(name, over=c.over).tried(self, table[name]) if name in table else MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Write the field into its table, and nothing for None."""
        if value is not None:
            table[name] = self.write(value, c.at(name, over=c.over))

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        """Return the JSON Schema of each key."""
        return {name: self.schema(define)}

    def rows(self, name: str) -> list[tuple[str, str]]:
        """Return each key with what it holds, for the documentation."""
        return [(name, self.words())]


def add_article(noun: str) -> str:
    """Return 'a link' for 'link', and 'an object' for 'object'."""
    return f"{'an' if noun[0] in 'aeiouAEIO' else 'a'} {noun}"


def make_expected_error(words: str, raw: Raw) -> InputError:
    """Return the error about a value of the wrong kind."""
    return InputError(f"must be {words}, got {format_value(raw)}")


def make_python_error(spec: Spec, value: Any) -> InputError:
    """Return the error about a Python object that a field cannot hold."""
    return InputError(f"expected {spec.accepts()}, got {format_value(value)}")
