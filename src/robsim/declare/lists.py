"""Lists of values: of one kind, or of names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import is_listed
from robsim.base.errors import InputError, said, suggest
from robsim.declare.fields import same
from robsim.declare.paths import item_part
from robsim.declare.problems import Broken, under
from robsim.declare.scalars import Number
from robsim.declare.spec import Context, Live, Raw, Spec, Unsayable, expected
from robsim.declare.tables import Table, keys_of
from robsim.declare.words import Text


@dataclass(frozen=True)
class ListOf(Spec):
    """A list of at least and at most so many values, which becomes a tuple."""

    item: Spec
    least: int = 0
    most: int = 10_000
    alone: bool = False  # whether in Python one value may stand for a list of it
    by_hand: bool = True  # whether a person may change its values by hand
    form: ClassVar[str] = "list"

    def check(self, value: Any, what: str) -> tuple[Any, ...]:
        if isinstance(value, Iterator):
            value = list(value)
        listed = isinstance(value, Sequence | np.ndarray) and is_listed(value)
        if self.alone and not listed:
            value, listed = [value], True
        if not listed or not self.least <= len(value) <= self.most:
            raise InputError(f"{what}: expected {self.words()}, got {said(value)}")
        return tuple(self.item.check(each, what) for each in value)

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        if not isinstance(raw, list):
            tables = self.item.form == "table" and isinstance(raw, Mapping) and c.path
            raise expected(f"a list of tables, [[{c.path[-1]}]]" if tables else "a valid list", raw)
        self._check_count(raw)
        before = c.problems.seen
        made = [c.at(label(each, i)).tried(self.item, each) for i, each in enumerate(raw)]
        if c.problems.seen > before:
            raise Broken
        return tuple(made)

    def write(self, value: Any, c: Context) -> list[Raw]:
        return [self.item.saved(each, c.at(i)) for i, each in enumerate(value)]

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value is not None and len(value):
            table[name] = self.write(value, c.at(name))

    def put_change(self, table: dict[str, Raw], name: str, old: Any, new: Any, c: Context) -> None:
        if old is None or not len(old) or not self.named or not isinstance(self.item, Table):
            self.put(table, name, new, c)
            return
        key = next(filter(None, map(name_key, self.item.inside())))
        if [getattr(each, key) for each in old] != [getattr(each, key) for each in new]:
            raise Unsayable
        table[name] = [
            self.item.change(a, b, c.at(name, getattr(b, key)), key)
            for a, b in zip(old, new, strict=True)
            if not same(a, b)
        ]

    def words(self) -> str:
        if self.least == self.most:
            return f"a list of {self.least}: {self.item.words()}"
        return f"a list, each {self.item.words()}"

    def accepts(self) -> str:
        words = self.words().replace(self.item.words(), self.item.accepts())
        return words.partition(", as in")[0]

    def schema(self, define: Any) -> dict[str, Any]:
        counts = {"minItems": self.least, "maxItems": self.most}
        return {"type": "array", "items": self.item.schema(define), **counts}

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        if isinstance(old, list) and isinstance(new, list) and self.named:
            return _merge_named(self.item, old, new, loose)
        if isinstance(old, list) and isinstance(new, Mapping):
            return _merge_numbered(self.item, old, new, loose)
        return new

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        kinds = self.item.inside()
        if type(self.item) is Number and value:
            unit = self.item.unit
            yield place.several(value, [str(i) for i in range(len(value))], unit, False)
        elif kinds and self.by_hand:
            key = next(filter(None, map(name_key, kinds)), None)
            for i, each in enumerate(value or ()):
                yield from self.item.controls(each, place.at(getattr(each, key) if key else i))

    @property
    def si_unit(self) -> str:
        return self.item.si_unit

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        kinds, first = self.item.inside(), keys[0]
        if not kinds or not isinstance(value, tuple):
            return []
        key = next(filter(None, map(name_key, kinds)), None)
        names = [getattr(each, key) if key else str(i) for i, each in enumerate(value)]
        if first not in names:
            return []
        del keys[0]
        return [item_part(self.item, names.index(first), c.at(first))]

    def inside(self) -> Sequence[type[Any]]:
        return self.item.inside()

    @property
    def named(self) -> bool:
        """Whether the things of the list have names, by which they are changed."""
        return any(name_key(kind) for kind in self.item.inside())

    def _check_count(self, raw: list[Raw]) -> None:
        count = len(raw)
        if not self.least <= count <= self.most:
            bound = "at least" if count < self.least else "at most"
            number = self.least if count < self.least else self.most
            how = f"{bound} {number}" if self.least < self.most else f"{number}"
            items = "item" if number == 1 else "items"
            raise InputError(f"must have {how} {items}, not {count}, got {said(raw)}")


NAME = Text(most=200)


@dataclass(frozen=True)
class Names(ListOf):
    """One name, or a list of names, which becomes a tuple."""

    item: Spec = NAME
    least: int = 1
    alone: bool = True
    forms: ClassVar[tuple[str, ...]] = ("plain", "list")

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        return super().read([raw] if isinstance(raw, str) else raw, c)

    def words(self) -> str:
        return "a name, or a list of names"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, super().schema(define)]}


def name_key(kind: type[Any]) -> str | None:
    """Return the key under which things of a class have their name; None if they have none."""
    return next((key for key in ("name", "robot") if key in keys_of(kind)), None)


def label(raw: Raw, number: int) -> str | int:
    """Return the name of a table, or its number; a library robot has that of its model."""
    table = raw if isinstance(raw, Mapping) else {}
    name = next((table[key] for key in ("name", "model", "robot") if key in table), None)
    return name if isinstance(name, str) and name else number


def references(table: Mapping[str, Raw]) -> set[str]:
    """Return the keys by which a table takes its links from elsewhere, as long as it does."""
    given = {"model", "urdf"} & table.keys()
    return {key for key in given if not isinstance(table[key], Live)}


def _merge_named(item: Spec, old: list[Raw], new: list[Raw], loose: bool) -> list[Raw]:
    where: dict[Any, int] = {}
    for i, table in enumerate(old):
        where.setdefault(label(table, i), i)
    merged, changed = list(old), set[str]()
    for number, table in enumerate(new):
        name = label(table, number)
        with under(name):
            if isinstance(name, int):
                raise InputError(f"needs the name of what it changes, got {said(table)}")
            if name in changed:
                raise InputError("there are two tables of this name; give one")
            changed.add(name)
            if name in where:
                inside = loose or bool(references(merged[where[name]]))
                merged[where[name]] = item.merge(merged[where[name]], table, inside)
            elif loose:
                merged.append(table)
            else:
                names = [n for n in where if isinstance(n, str)]
                hint = suggest(name[:64], names, "names")
                raise InputError(f"there is none to change; {hint}")
    return merged


def _merge_numbered(item: Spec, old: list[Raw], new: Mapping[str, Raw], loose: bool) -> list[Raw]:
    """Return a list in which things without names are changed by number: task.tasks.0.gain."""
    merged = list(old)
    for number, raw in new.items():
        with under(number):
            if not number.isdecimal() or int(number) >= len(old):
                raise InputError(f"there is none; they are numbered 0 to {len(old) - 1}")
            merged[int(number)] = item.merge(merged[int(number)], raw, loose)
    return merged
