"""Specs: the types of declared fields, with their checks, reading and writing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from robsim.base.arrays import Array
from robsim.base.decimal_comma import suggest_decimal_point
from robsim.base.errors import FileError, InputError, format_value
from robsim.declare.context import MISSING, Context, FieldValue, PythonValue, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.problems import UnreadableValue

DeclaredClass = type[Any]  # Any: a class with declared fields of any type
JSONSchema = dict[str, Any]  # Any: JSON
Shapes = tuple[tuple[int | str, ...], ...]  # valid shapes of the number of one run


class DefineSchema(Protocol):
    """Function that returns the reference to the JSON Schema of a declared class."""

    def __call__(self, kind: type, name: str = "") -> JSONSchema:
        """Return the reference to the schema of a class, as the kind of a name if there is one."""


def is_numeric(value: Any) -> bool:
    """Return whether a value is a number, or a nested list of numbers."""
    if isinstance(value, list):
        return all(map(is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def replace_whole(owner: Any, new: Any) -> Any:
    """Return the new value, for an owner that holds nothing else."""
    return new


@dataclass(frozen=True)
class PathPart:
    """A part of a value under one key.

    Attributes
    ----------
    spec, c : Spec and Context
        Spec of the part, and its context.
    get : callable
        Returns the part of an owner.
    put : callable
        Returns an owner with another part, checked.
    hold : callable
        Returns an owner with another part that is known to be valid.
    stack : callable or None
        Returns an owner with the numbers (runs, ...) of all runs; None if runs cannot differ.
    shapes : tuple
        Valid shapes of the number of one run.
    above : float or None
        Bound that every number exceeds if runs differ.
    meaning : str
        Description.
    """

    spec: Spec
    c: Context
    get: Callable[[Any], Any]
    put: Callable[[Any, Any], Any]
    hold: Callable[[Any, Any], Any] = replace_whole
    stack: Callable[[Any, Array], Any] | None = None
    shapes: Shapes = ()
    above: float | None = None
    meaning: str = ""

    def fits(self, shape: tuple[int, ...]) -> bool:
        """Return whether the number of one run may have a shape; a word stands for any size."""
        return any(
            len(shape) == len(valid_shape)
            and all(isinstance(n, str) or n == m for n, m in zip(valid_shape, shape, strict=True))
            for valid_shape in self.shapes
        )


class Spec:
    """Base of the types of declared fields.

    By default a field has a single key, its name; `keys`, `pick` and `put` can change this.
    """

    forms: ClassVar[tuple[str, ...]] = ("plain",)  # also "list", "table"; selects one of `OneOf`
    takes_none: ClassVar[bool] = False  # whether a default None is checked too
    united: ClassVar[bool] = False  # whether numbers have units in texts
    phrase: ClassVar[str] = ""  # constant phrase for valid values
    python_phrase: ClassVar[str] = ""  # constant phrase for valid Python values
    json: ClassVar[Mapping[str, Any]] = {}  # constant JSON Schema

    def check(self, value: object, what: str) -> FieldValue:
        """Return the value as the object stores it; InputError, naming `what`, if not valid."""
        return value

    def read(self, raw: Raw, c: Context) -> FieldValue:
        """Return the value of a text, merged into `c.over`; InputError with the valid values."""
        raise NotImplementedError

    def read_or_report(self, raw: Raw, c: Context) -> FieldValue:
        """Return the value of `raw`, also of a Python object; report errors and return MISSING."""
        try:
            if not isinstance(raw, PythonValue):
                return self.read(raw, c)
            value = self._check_python_value(raw.value, c)
            return value if raw.changes is None else self.read(raw.changes, c.with_old_value(value))
        except UnreadableValue:  # because of a problem that is reported elsewhere
            c.problems.total_count += 1
        except FileError:
            raise
        except InputError as error:
            c.blame(error)
        return MISSING

    def _check_python_value(self, value: Any, c: Context) -> FieldValue:
        """Return a Python object as the field stores it; plain values are read as in a text.

        Numbers of fields with a unit are in SI.
        """
        if isinstance(value, np.generic | np.ndarray) and not np.ndim(value):
            value = value.item()
        united = self.plain_spec.united and is_numeric(value)
        if isinstance(value, bool | int | float | list | dict | str) and not united:
            return self.read(value, c)
        try:
            return self.check(value, str(c.path[-1]) if c.path else "value")
        except (TypeError, ValueError, AttributeError, OverflowError) as error:
            if isinstance(error, InputError):
                raise
            expected = f"expected {self.accepts()}, got {format_value(value)}"
            raise InputError(expected) from None

    def write(self, value: object, c: Context) -> Raw:
        """Return the exact text value, or its difference from `c.over`.

        Raise NoTextError if there is no text, UnwritableChange if no text represents the
        difference.
        """
        raise NotImplementedError

    def words(self) -> str:
        """Return a phrase for the valid values."""
        return self.phrase

    def accepts(self) -> str:
        """Return a phrase for the valid Python values; by default the text phrase without units."""
        words, item = self.words(), getattr(self, "item", None)
        words = words if item is None else words.replace(item.words(), item.accepts())
        return self.python_phrase or words.partition(", as in")[0]

    def text_words(self) -> str:
        """Return a phrase for the valid text values, if it differs from `words`."""
        return self.words()

    def schema(self, define: DefineSchema) -> JSONSchema:
        """Return a JSON Schema; `define` returns the reference to a declared class."""
        return dict(self.json)

    def list_inner_classes(self) -> Sequence[DeclaredClass]:
        """Return the declared classes of valid tables."""
        return ()

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        """Return the controls of a value at its `ControlPlace`; none if it cannot be edited."""
        return ()

    @property
    def si_unit(self) -> str:
        """The SI unit of the numbers; "" if there is none."""
        return str(getattr(self, "unit", ""))

    @property
    def plain_spec(self) -> Spec:
        """The spec of a number of this field."""
        return self

    def parts(self, keys: list[str], value: object, c: Context) -> list[PathPart]:
        """Return the `PathPart`s of a value for the first keys, and remove these keys."""
        return []

    # the keys of the field in its table

    def keys(self, name: str) -> tuple[str, ...]:
        """Return the keys of the field in its table."""
        return (name,)

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        """Return the keys within the value that correspond to a key of the table."""
        return () if key == name else (key,)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> FieldValue:
        """Return the value of the field from its table; MISSING if it is absent or not valid."""
        inner = c.at(name, over=c.over)
        return self.read_or_report(table[name], inner) if name in table else MISSING

    def put(self, table: dict[str, Raw], name: str, value: object, c: Context) -> None:
        """Write the field into its table; nothing for None."""
        if value is not None:
            table[name] = self.write(value, c.at(name, over=c.over))

    def properties(self, name: str, define: DefineSchema) -> JSONSchema:
        """Return the JSON Schema of each key."""
        return {name: self.schema(define)}

    def rows(self, name: str) -> list[tuple[str, str]]:
        """Return each key with its type in words, for the documentation."""
        return [(name, self.words())]


def add_article(noun: str) -> str:
    """Return 'a link' for 'link', and 'an object' for 'object'."""
    return f"{'an' if noun[0] in 'aeiouAEIO' else 'a'} {noun}"


def make_expected_error(words: str, raw: Raw) -> InputError:
    """Return the error about a value of a wrong type."""
    return InputError(f"must be {words}, got {format_value(raw)}{suggest_decimal_point(raw)}")
