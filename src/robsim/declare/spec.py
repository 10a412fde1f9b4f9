"""The specification of what a declared field may hold: checked, read and written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from robsim.base.errors import FileError, InputError, said
from robsim.declare.problems import Broken, Problems, joined

Raw = Any  # what a TOML text holds: tables, lists, texts, numbers, truth values


class NoText(Exception):
    """The error about a value made of a user's Python code, which no text can hold."""


class _Missing:
    """The mark of a field without a value."""

    def __repr__(self) -> str:
        return "MISSING"


MISSING: Any = _Missing()


@dataclass(frozen=True)
class Live:
    """A Python object that stands in tables as it is, where no text can say it."""

    value: Any


UNREADABLE = Live(MISSING)  # stands where a value was, of which a problem is told already


@dataclass(frozen=True)
class Context:
    """The place of a value in a text, and what is known there.

    `facts` are what outer tables say, such as the scene whose joints give numbers their units.
    """

    problems: Problems
    path: tuple[str | int, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)

    def at(self, *keys: str | int) -> Context:
        """Return the context of a value inside."""
        return replace(self, path=(*self.path, *keys))

    def knowing(self, **facts: Any) -> Context:
        """Return the same place, where more is known."""
        return replace(self, facts={**self.facts, **facts})

    def report(self, text: str) -> None:
        """Add a problem of the value here."""
        self.problems.add(joined(*self.path), text)

    def blame(self, error: InputError) -> None:
        """Add an error about the value here, or about what it says is inside."""
        self.problems.add(joined(*self.path, error.path), error.text)

    def tried(self, spec: Spec, raw: Raw) -> Any:
        """Return the value that `raw` says, or MISSING with its problem reported."""
        if isinstance(raw, Live):
            return self._checked(spec, raw.value)
        try:
            return spec.read(raw, self)
        except Broken:  # for what is told elsewhere, so that nothing is made of the rest
            self.problems.seen += 1
            return MISSING
        except FileError:
            raise
        except InputError as error:
            self.blame(error)
            return MISSING

    def _checked(self, spec: Spec, value: Any) -> Any:
        """Return a Python object as the field keeps it, or MISSING with its problem reported."""
        if value is MISSING:  # UNREADABLE
            self.problems.seen += 1
            return MISSING
        try:
            return spec.check(value, str(self.path[-1]) if self.path else "value")
        except InputError as error:
            self.blame(error)
        except (TypeError, ValueError, AttributeError, OverflowError):  # of what is no number
            self.report(f"expected {spec.accepts()}, got {said(value)}")
        return MISSING


class Unsayable(Exception):
    """The signal that no table says how one value differs from another."""


class Spec:
    """The specification of what a declared field may hold.

    A field is written under its own name, unless `keys`, `pick` and `put` say otherwise.
    """

    form: ClassVar[str] = "plain"  # or "list", or "table": by which `OneOf` tells them apart
    forms: ClassVar[tuple[str, ...]] = ()  # where it is several
    takes_none: ClassVar[bool] = False  # whether None is checked as well, where it is the default
    united: ClassVar[bool] = False  # whether a text says it with a unit, and Python without

    def check(self, value: Any, what: str) -> Any:
        """Return the value as the object keeps it; InputError that names `what`."""
        return value

    def read(self, raw: Raw, c: Context) -> Any:
        """Return the value that a text says; InputError with what would be valid."""
        raise NotImplementedError

    def write(self, value: Any, c: Context) -> Raw:
        """Return how a text says the value, exactly; NoText if it cannot."""
        raise NotImplementedError

    def words(self) -> str:
        """Return what is expected, as a phrase."""
        raise NotImplementedError

    def accepts(self) -> str:
        """Return what Python code may give, as a phrase: what a text says, without its units."""
        return self.words().partition(", as in")[0]

    def text_words(self) -> str:
        """Return likewise what is expected in a text, where that is something else."""
        return self.words()

    def schema(self, define: Any) -> dict[str, Any]:
        """Return a JSON Schema; `define` gives the reference to that of a declared class."""
        raise NotImplementedError

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        """Return the text in which `new` changes `old`; `loose` where `old` is changes itself."""
        return new

    def inside(self) -> Sequence[type[Any]]:
        """Return the declared classes whose tables may stand here."""
        return ()

    def inside_of(self, raw: Raw) -> Sequence[type[Any]]:
        """Return the classes that such a raw value may be of."""
        return self.inside()

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

    def of_key(self, name: str, key: str) -> Spec:
        """Return what one of its keys may hold."""
        return self

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        """Return the keys within the value of the field to which one of its keys leads."""
        return () if key == name else (key,)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        """Return the value of the field from its table; MISSING if it is not there, or wrong."""
        return c.at(name).tried(self, table[name]) if name in table else MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Write the field into its table, and nothing for None."""
        if value is not None:
            table[name] = self.saved(value, c.at(name))

    def put_change(self, table: dict[str, Raw], name: str, old: Any, new: Any, c: Context) -> None:
        """Write what makes `new` of `old` where both tables are merged; Unsayable if nothing can.

        `new` is not None.
        """
        self.put(table, name, new, c)

    def saved(self, value: Any, c: Context) -> Raw:
        """Return how a text says a value; the value itself where none can, if that is allowed."""
        try:
            return self.write(value, c)
        except NoText:
            if not c.facts.get("live"):
                raise
            return Live(value)

    def beside(self, table: dict[str, Raw], name: str, over: Mapping[str, Raw]) -> None:
        """Take out of `table` what makes no sense beside the changes `over`."""

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        """Return the JSON Schema of each key."""
        return {name: self.schema(define)}

    def rows(self, name: str) -> list[tuple[str, str]]:
        """Return each key with what it holds, for the documentation."""
        return [(name, self.words())]


def with_article(noun: str) -> str:
    """Return 'a link' for 'link', and 'an object' for 'object'."""
    return f"{'an' if noun[0] in 'aeiouAEIO' else 'a'} {noun}"


def expected(words: str, raw: Raw) -> InputError:
    """Return the error about a value of the wrong kind."""
    return InputError(f"must be {words}, got {said(raw)}")
