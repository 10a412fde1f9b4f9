"""Tables of a text, read and written by what classes declare of their fields."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from robsim.base.errors import InputError, said, suggest
from robsim.base.values import hashable
from robsim.declare.fields import Field, fields_of, is_default, same
from robsim.declare.paths import field_parts
from robsim.declare.problems import Broken, under
from robsim.declare.spec import (
    MISSING,
    Context,
    NoText,
    Raw,
    Spec,
    Unsayable,
    expected,
    with_article,
)

LACKING = "missing, and it must be given"


def form_of(kind: type[Any]) -> type[Any]:
    """Return the class that declares how a table of this kind looks: mostly the kind itself."""
    form: type[Any] = getattr(kind, "text_form", kind)
    return form


def keys_of(kind: type[Any]) -> tuple[str, ...]:
    """Return the keys of the table of a class."""
    return tuple(key for each in fields_of(form_of(kind)) for key in each.spec.keys(each.name))


def read_table(
    kind: type[Any], raw: Raw, c: Context, *extra: str, form: type[Any] | None = None
) -> Any:
    """Return the object that a table says; Broken or InputError with all that is wrong."""
    if not isinstance(raw, Mapping):
        raise expected("a table", raw)
    form, before = form or form_of(kind), c.problems.seen
    _report_unknown(form, raw, c, extra)
    given: dict[str, Any] = {}
    inner = c.knowing(own=given, also=())
    if prepare := getattr(form, "text_facts", None):
        inner = prepare(raw, inner)
    for each in fields_of(form):
        value = pick(each, raw, inner)
        if value is not MISSING:
            given[each.name] = value
    if check := getattr(form, "text_check", None):
        check(raw, inner)
    if c.problems.seen > before:
        raise Broken
    made = form(**given)
    return made if form is kind else made.made(inner)


def pick(each: Field, raw: Mapping[str, Raw], c: Context) -> Any:
    """Return the value of a field from its table; MISSING if it is not there, or wrong."""
    before = c.problems.seen
    value = each.spec.pick(raw, each.name, c)
    if value is MISSING and each.required and c.problems.seen == before:
        c.at(each.name).report(LACKING)
    return value


def write_table(value: Any, c: Context, form: type[Any] | None = None) -> dict[str, Raw]:
    """Return the table that says an object, exactly; NoText if a text cannot."""
    form = form or form_of(type(value))
    own, inner = said_of(value, c, form)
    table: dict[str, Raw] = {}
    for each in fields_of(form):
        if not (c.facts.get("brief") and is_default(each, own[each.name])):
            each.spec.put(table, each.name, own[each.name], inner)
    return table


def said_of(value: Any, c: Context, form: type[Any]) -> tuple[dict[str, Any], Context]:
    """Return the declared fields of an object as its table says them, and what is known there."""
    source = value if form is type(value) else form.of(value, c)
    own = {each.name: getattr(source, each.name) for each in fields_of(form)}
    _check_plain(source, own)
    inner = c.knowing(own=own, owner=value)
    prepare = getattr(form, "written_facts", None)
    return own, prepare(value, inner) if prepare else inner


def difference(
    old: Any, new: Any, c: Context, form: type[Any] | None = None, key: str | None = None
) -> dict[str, Raw]:
    """Return the table that makes `new` of `old` where it is merged with that one's.

    The value of a `key` is there in any case. Unsayable: there is no such table.
    """
    form = form or form_of(type(new))
    if type(old) is not type(new):
        raise Unsayable
    before, _ = said_of(old, c.knowing(brief=False), form)
    after, inner = said_of(new, c.knowing(brief=False), form)
    table: dict[str, Raw] = {}
    for each in fields_of(form):
        a, b = before[each.name], after[each.name]
        if each.name == key:
            table[key] = b
        elif not same(a, b):
            if b is None:
                raise Unsayable
            each.spec.put_change(table, each.name, a, b, inner)
            if not table.keys() & set(each.spec.keys(each.name)):
                raise Unsayable
    return table


def merge_table(kind: type[Any], old: Raw, new: Raw, loose: bool) -> Raw:
    """Return the table in which `new` changes `old`, and nothing stays that makes no sense."""
    if not isinstance(old, Mapping) or not isinstance(new, Mapping):
        return new
    merged, owners = dict(old), dict[str, Field]()
    for each in fields_of(form_of(kind)):
        owners |= dict.fromkeys(each.spec.keys(each.name), each)
        each.spec.beside(merged, each.name, new)
    for key, raw in new.items():
        if key in owners and key in merged:
            with under(key):
                merged[key] = owners[key].spec.merge(merged[key], raw, loose)
        else:
            merged[key] = raw
    return merged


def _report_unknown(form: type[Any], raw: Mapping[str, Raw], c: Context, extra: Any) -> None:
    known = (*extra, *keys_of(form), *c.facts.get("also", ()))
    for key in raw:
        if key in known:
            continue
        if c.problems.full:
            c.problems.untold += 1
            c.problems.seen += 1
        else:
            c.at(key).report(f"unknown key {said(key)}; {suggest(key[:64], known, 'keys')}")


def _check_plain(source: Any, own: dict[str, Any]) -> None:
    """Raise NoText if an object holds what its declared fields do not say."""
    for each in dataclasses.fields(source):
        if each.init and each.compare and each.name not in own:  # what is part of the value
            plain, value = each.default, getattr(source, each.name)
            if type(plain) is not type(value) or hashable(plain) != hashable(value):
                raise NoText(f"{type(source).__name__} has a {each.name} of its own")


def controls_of(value: Any, place: Any, form: type[Any] | None = None) -> Iterator[Any]:
    """Yield the controls of all declared fields of an object, in their order."""
    form = form or form_of(type(value))
    source = value if form is type(value) else form.of(value, place.c)
    c = place.c.knowing(own={each.name: getattr(source, each.name) for each in fields_of(form)})
    if facts := getattr(form, "written_facts", None):
        c = facts(value, c)
    for each in fields_of(form):
        inner = replace(place.at(each.name, each.meaning), c=c)
        yield from each.spec.controls(getattr(source, each.name), inner)


@dataclass(frozen=True)
class Table(Spec):
    """A table of one class, in the form of the class `says` if that is another."""

    kind: type[Any]
    says: type[Any] | None = None
    form: ClassVar[str] = "table"

    def check(self, value: Any, what: str) -> Any:
        if not isinstance(value, self.kind):
            raise InputError(f"{what}: expected {self.words()}, got {said(value)}")
        return value

    def read(self, raw: Raw, c: Context) -> Any:
        return read_table(self.kind, raw, c, form=self.says)

    def write(self, value: Any, c: Context) -> Raw:
        if type(value) is not self.kind:
            raise NoText(f"{type(value).__name__} is Python code")
        return write_table(value, c, self.says)

    def put_change(self, table: dict[str, Raw], name: str, old: Any, new: Any, c: Context) -> None:
        if old is None or form_of(type(new)) is not form_of(self.kind):
            self.put(table, name, new, c)
        else:
            table[name] = self.change(old, new, c.at(name))

    def change(self, old: Any, new: Any, c: Context, key: str | None = None) -> dict[str, Raw]:
        """Return the table that makes `new` of `old`, with the value of a `key` in any case."""
        return difference(old, new, c, self.says, key)

    def words(self) -> str:
        return with_article(self.kind.__name__)

    def schema(self, define: Any) -> dict[str, Any]:
        reference: dict[str, Any] = define(self.says or self.kind)
        return reference

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        return merge_table(self.says or self.kind, old, new, loose)

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        if self.says is None and not dataclasses.is_dataclass(value):
            return []
        return field_parts(self.says or form_of(type(value)), keys, value, c)

    def inside(self) -> Sequence[type[Any]]:
        return (self.says or self.kind,)

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return () if value is None else controls_of(value, place, self.says)
