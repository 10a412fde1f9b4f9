"""The location of a value in a text, and signals about values that a text cannot hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from robsim.base.errors import InputError
from robsim.declare.problems import Problems, join_keys

Raw = Any  # Any: a TOML value, which is a table, list, text, number or truth value
FieldValue = Any  # Any: a declared field may hold a value of any type


class NoTextError(Exception):
    """The error about a value that contains a user's Python code and has no text."""


class UnwritableChange(Exception):
    """The signal that no table can represent the difference between two values."""


class _Missing:
    """The type of MISSING, which marks a field without a value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING: Any = _Missing()


@dataclass(frozen=True)
class PythonValue:
    """A Python object in a table, and a table of changes to it."""

    value: Any
    changes: Mapping[str, Raw] | None = None


@dataclass(frozen=True)
class Context:
    """The location of a value in a text, and facts from the outer tables.

    `facts` include the scene, which defines the units of joint numbers. `over` is the old value if
    the text changes a value: `Spec.read` then keeps the parts that the text does not change, and
    `Spec.write` omits equal parts. `over` applies to this location only.
    """

    problems: Problems
    path: tuple[str | int, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    over: Any = MISSING

    def at(self, *keys: str | int, over: Any = MISSING) -> Context:
        """Return the context of an inner value."""
        return Context(self.problems, (*self.path, *keys), self.facts, over)

    def with_old_value(self, old: Any) -> Context:
        """Return the context of a change to an old value."""
        return Context(self.problems, self.path, self.facts, old)

    def with_facts(self, **facts: Any) -> Context:
        """Return the same context with more facts."""
        return Context(self.problems, self.path, {**self.facts, **facts}, self.over)

    def report(self, text: str) -> None:
        """Add a problem of the value at this location."""
        self.problems.add(join_keys(*self.path), text)

    def blame(self, error: InputError) -> None:
        """Add an error of the value at this location, or of an inner value."""
        self.problems.add(join_keys(*self.path, error.path), error.text)
