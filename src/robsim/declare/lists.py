"""Lists of values, and lists of names."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, cast

import numpy as np

from robsim.base.arrays import has_items
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.declare.choices import KindOf
from robsim.declare.context import Context, FieldValue, Raw, UnwritableChange
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.dotted_paths import make_item_part
from robsim.declare.fields import is_identical
from robsim.declare.problems import UnreadableValue
from robsim.declare.scalars import Number
from robsim.declare.spec import (
    DeclaredClass,
    DefineSchema,
    JSONSchema,
    PathPart,
    Spec,
    make_expected_error,
)
from robsim.declare.tables import Table, get_table_keys
from robsim.declare.texts import Text


@dataclass(frozen=True)
class ListOf(Spec):
    """A field with a list of values, which becomes a tuple.

    Parameters
    ----------
    item : Spec
        Spec of each value.
    least, most : int, default 0 and 10000
        Bounds of the number of values.
    alone : bool, default False
        Whether Python code may pass a single value instead of a list.
    by_hand : bool, default True
        Whether user interfaces offer the values for editing.
    names : sequence of str, optional
        Names of numbers in user interfaces.
    in_turn : bool, default False
        Whether the reading of an item depends on the previous items.
    growing : bool, default False
        Whether user interfaces add and remove values, which are kinds of a family.

    Examples
    --------
    >>> from robsim.declare import Length
    >>> ListOf(Length(), 1).check([1, 2.5], "sizes")
    (1.0, 2.5)
    """

    item: Spec
    least: int = 0
    most: int = 10_000
    alone: bool = False
    by_hand: bool = True
    names: Sequence[str] = ()
    in_turn: bool = False
    growing: bool = False
    forms: ClassVar[tuple[str, ...]] = ("list",)

    def check(self, value: FieldValue, what: str) -> tuple[FieldValue, ...]:
        if isinstance(value, Iterator):
            value = list(value)
        is_list = isinstance(value, Sequence | np.ndarray) and has_items(value)
        if self.alone and not is_list:
            value, is_list = [value], True
        if not is_list or self.least == self.most != len(value):
            raise InputError(f"{what}: expected {self.accepts()}, got {format_value(value)}")
        self._check_count(value, f"{what} ")
        return tuple(self.item.check(each, what) for each in value)

    def read(self, raw: Raw, c: Context) -> tuple[FieldValue, ...]:
        if self._is_change(raw, c.over):
            return self._read_changes(raw, c)
        if not isinstance(raw, list):
            tables = self.item.forms == ("table",) and isinstance(raw, Mapping) and c.path
            raise make_expected_error(
                f"a list of tables, [[{c.path[-1]}]]" if tables else "a valid list", raw
            )
        self._check_count(raw)
        before = c.problems.total_count
        values = [
            self.item.read_or_report(each, c.at(get_item_label(each, i)))
            for i, each in enumerate(raw)
        ]
        if c.problems.total_count > before:
            raise UnreadableValue
        return tuple(values)

    def write(self, value: FieldValue, c: Context) -> list[Raw]:
        if not isinstance(c.over, tuple) or not c.over or not self.named:
            return [self.item.write(each, c.at(i)) for i, each in enumerate(value)]
        table, names = cast(Table, self.item), self._list_labels(value)
        if self._list_labels(c.over) != names:
            raise UnwritableChange
        return [
            table.build_table(new, c.at(name, over=old), self._name_key)
            for name, old, new in zip(names, c.over, value, strict=True)
            if not is_identical(old, new)
        ]

    def put(self, table: dict[str, Raw], name: str, value: FieldValue, c: Context) -> None:
        if value is not None and len(value):
            super().put(table, name, value, c)

    def words(self) -> str:
        if self.phrase:
            return self.phrase
        if self.least == self.most:
            return f"a list of {self.least}: {self.item.words()}"
        return f"a list, each {self.item.words()}"

    def schema(self, define: DefineSchema) -> JSONSchema:
        counts = {"minItems": self.least, "maxItems": self.most}
        return {"type": "array", "items": self.item.schema(define), **counts}

    def controls(self, value: FieldValue, place: ControlPlace) -> Iterable[Control]:
        if type(self.item) is Number and value is not None and len(value):
            unit = self.item.unit
            names = self.names or [str(i) for i in range(len(value))]
            yield place.several(value, names, unit, False)
        elif self.item.list_inner_classes() and self.by_hand:
            if self.growing and isinstance(self.item, KindOf):
                yield self._offer_items(value or (), place)
            for name, each in zip(self._list_labels(value or ()), value or (), strict=True):
                yield from self.item.controls(each, place.at(name))

    def _offer_items(self, value: Sequence[object], place: ControlPlace) -> Control:
        """Return the control that adds and removes objects of a family."""
        assert isinstance(self.item, KindOf)
        kinds = [self.item.family.name_of(each) or type(each).__name__ for each in value]
        return place.item_list(value, kinds, self.item.make_starters(), (self.least, self.most))

    @property
    def si_unit(self) -> str:
        return self.item.si_unit

    def parts(self, keys: list[str], value: object, c: Context) -> list[PathPart]:
        if not self.item.list_inner_classes() or not isinstance(value, tuple):
            return []
        names = self._list_labels(value)
        if keys[0] not in names:
            return []
        first = keys.pop(0)
        return [make_item_part(self.item, names.index(first), c.at(first))]

    def list_inner_classes(self) -> Sequence[DeclaredClass]:
        return self.item.list_inner_classes()

    @property
    def named(self) -> bool:
        """Whether the items have names, which a text uses to change them."""
        return bool(self._name_key) and isinstance(self.item, Table)

    @property
    def _name_key(self) -> str:
        """The key of the names of the items; "" if they have no names."""
        keys = [find_name_key(kind) for kind in self.item.list_inner_classes()]  # type: ignore[arg-type]
        return next(filter(None, keys), "")

    def _list_labels(self, value: Sequence[Any]) -> list[str]:
        """Return the names of the items, or their numbers."""
        key = self._name_key
        return [getattr(each, key) if key else str(i) for i, each in enumerate(value)]

    def _is_change(self, raw: Raw, old: Any) -> bool:
        """Return whether a text changes items of an old list, instead of replacing the list."""
        several = isinstance(old, tuple) and bool(old) and bool(self.item.list_inner_classes())
        return several and isinstance(raw, list if self.named else Mapping)

    def _read_changes(self, raw: Raw, c: Context) -> tuple[FieldValue, ...]:
        """Return the old list with changed items, by their names or numbers."""
        before, labels = c.problems.total_count, self._list_labels(c.over)
        changes = self._collect_changes_by_name(raw, c) if isinstance(raw, list) else dict(raw)
        numbered = f"; they are numbered 0 to {len(labels) - 1}"
        for name in changes.keys() - set(labels):
            near = f" to change; {suggest_names(name[:64], labels, 'names')}"
            hint = near if self.named else numbered
            c.at(name).report(f"there is none{hint}")
        if self.in_turn:
            changes = {name: changes.get(name, {}) for name in labels}
        values = [
            self.item.read_or_report(changes[name], c.at(name, over=old))
            if name in changes
            else old
            for name, old in zip(labels, c.over, strict=True)
        ]
        if c.problems.total_count > before:
            raise UnreadableValue
        return tuple(values)

    def _collect_changes_by_name(self, raw: list[Raw], c: Context) -> dict[str, Raw]:
        """Return the changes in a list of tables, by the names in the tables."""
        changes: dict[str, Raw] = {}
        for i, table in enumerate(raw):
            name = get_item_label(table, i)
            if isinstance(name, int):
                c.at(i).report(f"needs the name of the item to change, got {format_value(table)}")
            elif name in changes:
                c.at(name).report("there are two tables of this name; give one")
            else:
                changes[name] = table
        return changes

    def _check_count(self, values: Sequence[object], who: str = "") -> None:
        count = len(values)
        if not self.least <= count <= self.most:
            bound = f"at least {self.least}" if count < self.least else f"at most {self.most}"
            how = bound if self.least < self.most else f"{self.least}"
            items = f"{how} item" if how.split()[-1] == "1" else f"{how} items"
            raise InputError(f"{who}must have {items}, not {count}, got {format_value(values)}")


NAME = Text(most=200)


@dataclass(frozen=True)
class Names(ListOf):
    """One name, or a list of names, which becomes a tuple."""

    item: Spec = NAME
    least: int = 1
    alone: bool = True
    forms: ClassVar[tuple[str, ...]] = ("plain", "list")
    phrase: ClassVar[str] = "a name, or a list of names"

    def read(self, raw: Raw, c: Context) -> tuple[FieldValue, ...]:
        return super().read([raw] if isinstance(raw, str) else raw, c)

    def schema(self, define: DefineSchema) -> JSONSchema:
        return {"anyOf": [{"type": "string"}, super().schema(define)]}


@cache
def find_name_key(kind: DeclaredClass) -> str | None:
    """Return the key of the names of objects of a class; None if they have no names."""
    return next((key for key in ("name", "robot") if key in get_table_keys(kind)), None)


def get_item_label(raw: Raw, number: int) -> str | int:
    """Return the name of a table, or its number; the name of a library robot is its model."""
    table = raw if isinstance(raw, Mapping) else {}
    name = next((table[key] for key in ("name", "model", "robot") if key in table), None)
    return name if isinstance(name, str) and name else number
