"""Tables of a text, read and written by the declared fields of classes."""

from __future__ import annotations

import dataclasses
from collections import ChainMap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.value import make_hashable
from robsim.declare.context import (
    MISSING,
    Context,
    FieldValue,
    NoTextError,
    PythonValue,
    Raw,
    UnwritableChange,
)
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.dotted_paths import find_field_parts, get_inner_context
from robsim.declare.fields import (
    DeclaredField,
    Role,
    fields_of,
    get_default,
    is_default,
    is_identical,
)
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import (
    DeclaredClass,
    DefineSchema,
    JSONSchema,
    PathPart,
    Spec,
    add_article,
    make_expected_error,
)

LACKING = "missing, and it must be given"
Fields = dict[str, Any]


def get_text_form(kind: DeclaredClass) -> DeclaredClass:
    """Return the class that declares the table of a kind: its `text_form`, or the kind itself."""
    form: DeclaredClass = getattr(kind, "text_form", kind)
    return form


def get_table_keys(kind: DeclaredClass) -> tuple[str, ...]:
    """Return the keys of the table of a class."""
    return tuple(
        key for each in fields_of(get_text_form(kind)) for key in each.spec.keys(each.name)
    )


def find_declared_field(kind: DeclaredClass, name: str) -> DeclaredField:
    """Return the declared field of a class with a name."""
    return next(each for each in fields_of(get_text_form(kind)) if each.name == name)


def read_table(
    kind: DeclaredClass, raw: Raw, c: Context, *extra: str, form: DeclaredClass | None = None
) -> Any:
    """Return the object of a table, or the object `c.over` with the changes of the table.

    If `c.over` is of another kind, fields with the same declaration are kept. Raise UnreadableValue
    or InputError if the table is not valid.
    """
    if not isinstance(raw, Mapping):
        raise make_expected_error("a table", raw)
    form, before = form or get_text_form(kind), c.problems.total_count
    report_unknown_keys(raw, (*extra, *get_table_keys(form), *c.facts.get("also", ())), c)
    source = _convert_old_value(form, c)
    removed = {
        key for key, each in raw.items() if isinstance(each, PythonValue) and each.value is None
    }
    raw = {key: each for key, each in raw.items() if key not in removed}
    kept_fields = _collect_kept_fields(form, source, removed | _find_rival_fields(form, raw, c))
    own_fields = _read_fields(form, raw, kept_fields, c)
    if c.problems.total_count > before:
        raise UnreadableValue
    value = replace(source, **own_fields) if type(source) is form else form(**own_fields)
    return value if form is kind else value.build_value(c.with_facts(own=own_fields))


def _convert_old_value(form: DeclaredClass, c: Context) -> Any:
    """Return the old object in the form of its table; MISSING if there is none."""
    if c.over is MISSING or not callable(getattr(form, "of", None)) or type(c.over) is form:
        return c.over
    return form.of(c.over, c.with_facts(brief=True, short=True))


def _find_rival_fields(form: DeclaredClass, raw: Mapping[str, Raw], c: Context) -> set[str]:
    """Return the fields that exclude fields of a table; report exclusive fields of the table."""
    excluded = set[str]()
    for group in getattr(form, "rivals", ()):
        keys_of = {each.name: each.spec.keys(each.name) for each in fields_of(form)}
        ways = {way: [key for name in way for key in keys_of[name] if key in raw] for way in group}
        present = [", ".join(keys) for keys in ways.values() if keys]
        if len(present) > 1:
            c.report(f"{' and '.join(present)}: give one of them only")
        excluded |= {name for way, keys in ways.items() if present and not keys for name in way}
    return excluded


def _collect_kept_fields(form: DeclaredClass, source: Any, removed: set[str]) -> Fields:
    """Return the fields of an old object that a table leaves unchanged."""
    if source is MISSING:
        return {}
    fields = fields_of(form)
    if type(source) is not form:
        before = [(each.name, each.spec) for each in fields_of(type(source))]
        fields = tuple(each for each in fields if (each.name, each.spec) in before)
    return {each.name: getattr(source, each.name) for each in fields if each.name not in removed}


def _read_fields(
    form: DeclaredClass, raw: Mapping[str, Raw], kept_fields: Fields, c: Context
) -> Fields:
    """Return the fields of a table, the kept fields, and the defaults of the others."""
    fields, first = fields_of(form), getattr(form, "facts_from", ())
    absent = [each for each in fields if not raw.keys() & each.spec.keys(each.name)]
    defaults = {each.name: each.default for each in absent if not each.required}
    read_values: Fields = {}
    own = ChainMap(read_values, kept_fields, defaults)
    inner = c.with_old_value(MISSING).with_facts(own=own, raw=raw, also=())
    facts = getattr(form, "facts", None)
    for each in sorted(fields, key=lambda each: each.name not in first):
        if facts and each.name not in first:
            inner, facts = facts(own, inner), None
        value = read_field(each, raw, inner.with_old_value(kept_fields.get(each.name, MISSING)))
        if value is not MISSING:
            read_values[each.name] = value
    if check := getattr(form, "text_check", None):
        check(raw, inner)
    return dict(own)


def read_field(each: DeclaredField, raw: Mapping[str, Raw], c: Context) -> Any:
    """Return the value of a field from its table; MISSING if it is absent or not valid."""
    before = c.problems.total_count
    value = each.spec.pick(raw, each.name, c)
    is_lacking = value is MISSING and each.required and c.over is MISSING
    if is_lacking and c.problems.total_count == before:
        c.at(each.name).report(LACKING)
    return value


def write_table(
    value: Any, c: Context, form: DeclaredClass | None = None, key: str | None = None
) -> dict[str, Raw]:
    """Return the exact table of an object, or its difference from the object `c.over`.

    The value of `key` is always included. Raise NoTextError if the object has no text,
    UnwritableChange if no text represents the difference.
    """
    form = form or get_text_form(type(value))
    if c.over is not MISSING:
        return _write_changes(value, c, form, key)
    own, inner = _collect_field_values(value, c, form)
    table: dict[str, Raw] = {}
    for each in fields_of(form):
        if not (c.facts.get("brief") and is_default(each, own[each.name])):
            each.spec.put(table, each.name, own[each.name], inner)
    return table


def _write_changes(value: Any, c: Context, form: DeclaredClass, key: str | None) -> dict[str, Raw]:
    if type(c.over) is not type(value):
        raise UnwritableChange
    plain = c.with_facts(brief=False, changes=True)
    before, _ = _collect_field_values(c.over, plain, form)
    after, inner = _collect_field_values(value, plain, form)
    new_inner = inner.with_facts(brief=c.facts.get("brief"), changes=False)
    table: dict[str, Raw] = {} if key is None else {key: after[key]}
    for each in fields_of(form):
        old, new = before[each.name], after[each.name]
        is_replaced = new is None and _is_replaced(form, each.name, after)
        if is_replaced or each.name == key or is_identical(old, new):
            continue
        if new is not None:
            where = new_inner if old is None else inner.with_old_value(old)
            each.spec.put(table, each.name, new, where)
        if not table.keys() & set(each.spec.keys(each.name)):
            raise UnwritableChange
    return table


def _is_replaced(form: DeclaredClass, name: str, own: Fields) -> bool:
    """Return whether an exclusive field replaces a field that is None now."""
    groups = (group for group in getattr(form, "rivals", ()) if any(name in way for way in group))
    ways = (way for group in groups for way in group if name not in way)
    return any(own[each] is not None for way in ways for each in way)


def _collect_field_values(value: Any, c: Context, form: DeclaredClass) -> tuple[Fields, Context]:
    """Return the declared fields of an object in the form of its table, and the inner context."""
    c = c.with_old_value(MISSING)
    source = value if form is type(value) else form.of(value, c)
    own = {each.name: getattr(source, each.name) for each in fields_of(form)}
    _check_undeclared_fields(source, own)
    inner = c.with_facts(own=own, raw={})
    return own, form.facts(own, inner) if hasattr(form, "facts") else inner


def report_unknown_keys(raw: Iterable[str], known: Collection[str], c: Context) -> None:
    """Report the keys of a table that are not known, each with the nearest known one."""
    for key in raw:
        if key not in known:  # a problem that is only counted needs no suggestion, which is slow
            hint = "" if c.problems.full else suggest_names(key[:64], known, "keys")
            c.at(key).report(f"unknown key {format_value(key)}; {hint}")


def _check_undeclared_fields(source: Any, own: Fields) -> None:
    """Raise NoTextError if an object has values outside its declared fields."""
    if not dataclasses.is_dataclass(source):
        undeclared = dict.fromkeys(getattr(source, "__dict__", ()), MISSING)
    else:
        listed = [each for each in dataclasses.fields(source) if each.init and each.compare]
        undeclared = {each.name: get_default(each) for each in listed if each.name not in own}
    for name, plain in undeclared.items():
        value = getattr(source, name)
        if type(plain) is not type(value) or make_hashable(plain) != make_hashable(value):
            form = "a text has the declared fields of a frozen dataclass"
            raise NoTextError(f"{type(source).__name__} has a {name} of its own; {form}")


def yield_controls(
    value: Any, place: ControlPlace, form: DeclaredClass | None = None
) -> Iterator[Control]:
    """Yield the controls of the declared fields of an object, in their order.

    Content of files and of messages is left out. Dynamics have controls if a drive acts, with the
    fact `driven`. A class may name further fields in `without_controls`.
    """
    form = form or get_text_form(type(value))
    source = value if form is type(value) else form.of(value, place.c)
    c = get_inner_context(form, value, place.c)
    without = getattr(form, "without_controls", ())
    idle = {Role.FILE, Role.MESSAGE, *([] if c.facts.get("driven") else [Role.DRIVE])}
    for each in fields_of(form):
        if each.role not in idle and each.name not in without:
            inner = place.at(each.name, each.meaning, c)
            yield from each.spec.controls(getattr(source, each.name), inner)


@dataclass(frozen=True)
class Table(Spec):
    """A field with a table of one class.

    Parameters
    ----------
    kind : type
        Class of the object.
    says : type, optional
        Class that declares the keys, if it is not `kind`.
    flat : bool, default False
        Whether the keys are in the outer table.

    Examples
    --------
    >>> from robsim import Safety
    >>> Table(Safety).words()
    'a Safety'
    """

    kind: DeclaredClass
    says: DeclaredClass | None = None
    flat: bool = False
    forms: ClassVar[tuple[str, ...]] = ("table",)

    @property
    def declared(self) -> DeclaredClass:
        """The class that declares the keys of the table."""
        return self.says or get_text_form(self.kind)

    def check(self, value: object, what: str) -> FieldValue:
        if not isinstance(value, self.kind):
            raise InputError(f"{what}: expected {self.accepts()}, got {format_value(value)}")
        return value

    def read(self, raw: Raw, c: Context) -> FieldValue:
        known = isinstance(c.over, self.kind) or type(c.over) is self.says
        return read_table(self.kind, raw, c if known else c.with_old_value(MISSING), form=self.says)

    def write(self, value: object, c: Context) -> Raw:
        return self.build_table(value, c)

    def build_table(self, value: object, c: Context, key: str | None = None) -> dict[str, Raw]:
        """Return the table of a value; the value of `key` is always included."""
        if type(value) is not self.kind:
            raise NoTextError(f"{type(value).__name__} is Python code")
        known = type(c.over) is type(value)
        return write_table(value, c if known else c.with_old_value(MISSING), self.says, key)

    def words(self) -> str:
        return self.phrase or add_article(self.kind.__name__)

    def schema(self, define: DefineSchema) -> JSONSchema:
        return define(self.says or self.kind)

    def parts(self, keys: list[str], value: object, c: Context) -> list[PathPart]:
        return find_field_parts(self.says or get_text_form(type(value)), keys, value, c)

    def list_inner_classes(self) -> Sequence[DeclaredClass]:
        return (self.says or self.kind,)

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        around = replace(place, path=place.path.rpartition(".")[0]) if self.flat else place
        return () if value is None else yield_controls(value, around, self.says)

    def keys(self, name: str) -> tuple[str, ...]:
        return get_table_keys(self.declared) if self.flat else (name,)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> FieldValue:
        if not self.flat:
            return super().pick(table, name, c)
        values = {key: table[key] for key in self.keys(name) if key in table}
        return self.read_or_report(values, c) if values else MISSING

    def put(self, table: dict[str, Raw], name: str, value: object, c: Context) -> None:
        if not self.flat:
            super().put(table, name, value, c)
        elif value is not None:
            table |= self.build_table(value, c)

    def properties(self, name: str, define: DefineSchema) -> JSONSchema:
        if not self.flat:
            return super().properties(name, define)
        fields = [
            (each, each.spec.properties(each.name, define)) for each in fields_of(self.declared)
        ]
        return {
            key: {**x, "description": each.meaning}
            for each, schemas in fields
            for key, x in schemas.items()
        }


@dataclass(frozen=True)
class PartTable(Table):
    """A table of a frozen part, whose controls are cached in it.

    The controls depend on the part, and on whether a drive acts.
    """

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        known: dict[tuple[str, bool], list[Control]] = vars(value).setdefault("_controls", {})
        key = place.path, bool(place.c.facts.get("driven"))
        if key not in known:
            known[key] = list(super().controls(value, place))
        return known[key]
