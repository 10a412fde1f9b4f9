"""Fields that hold one of several kinds, by name or by table."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar

from robsim.base.decimal_comma import suggest_decimal_point
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.protocols import describe_protocol, implements
from robsim.declare.context import MISSING, Context, FieldValue, NoTextError, PythonValue, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.dotted_paths import find_field_parts
from robsim.declare.error_phrases import join_alternatives, pluralize
from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.kind_families import KindFamily
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
from robsim.declare.tables import (
    LACKING,
    find_declared_field,
    get_text_form,
    read_field,
    read_table,
    report_unknown_keys,
    write_table,
    yield_controls,
)


@dataclass(frozen=True)
class KindOf(Spec):
    """A field with one of the kinds of a family: a name, a table with `kind`, or an object.

    Parameters
    ----------
    family : KindFamily
        Family of the kinds, see `family`.
    default : str, optional
        Kind of a table without `kind`.
    beside_of : dict of str to (str, str), optional
        Keys beside the name that replace a table: {key: (kind, field)}.
    protocol : type, optional
        Protocol of user objects that do not belong to the family.
    short : bool, default True
        Whether the name alone is valid for kinds without required fields.
    none : str, optional
        Word for None.
    plain : tuple of str, optional
        Words that are stored as they are.
    other : Spec, optional
        Other valid values, such as numbers.
    only : tuple of str, optional
        Valid kinds. Default: all kinds of the family.

    Examples
    --------
    >>> from robsim.declare import family
    >>> KindOf(family("law")).check("joint", "law")
    JointLaw()
    """

    family: KindFamily
    default: str | None = None
    beside_of: Mapping[str, tuple[str, str]] = field(default_factory=dict, hash=False)
    protocol: type | None = None
    short: bool = True
    none: str | None = None
    plain: tuple[str, ...] = ()
    other: Spec | None = None
    only: tuple[str, ...] | None = None
    forms: ClassVar[tuple[str, ...]] = ("plain", "table")

    @property
    def names(self) -> list[str]:
        """The names of the valid kinds."""
        return [name for name in self.family.names if self.only is None or name in self.only]

    def check(self, value: object, what: str) -> FieldValue:
        if isinstance(value, str):
            if value in self.plain or value == self.none:
                return value if value in self.plain else None
            if value in self._find_names(value):
                return _make_default_kind(self.family.find(value), value, what)
        elif not isinstance(value, type):
            if self._is_allowed(value):
                return value
            if self.protocol is not None and implements(value, self.protocol):
                return value
            if self.other is not None and value is not None:
                return self.other.check(value, what)
        hint = suggest_names(value, [*self.plain, *self.names], pluralize(self.family.noun))
        more = f", or {self.other.words()}" if self.other else ""
        more += f", or {describe_protocol(self.protocol)}" if self.protocol else ""
        unknown = f"no {self.family.noun} {format_value(value)}"
        wrong = unknown if isinstance(value, str) else self._describe_mismatch(value)
        raise InputError(f"{what}: {wrong}; {hint}{more}")

    def read(self, raw: Raw, c: Context) -> FieldValue:
        if isinstance(raw, str) and raw in self.plain:
            return raw
        if isinstance(raw, str) and self.short and raw in self._find_names(raw):
            return read_table(self.family.find(raw), {}, c.with_old_value(MISSING))
        if not isinstance(raw, Mapping):
            return self._read_other(raw, c)
        old = self.family.name_of(c.over)
        if old is None and is_dataclass(c.over) and "kind" not in raw:
            return _replace_user_fields(c.over, raw, c)
        kind = raw.get("kind", old or self.default)
        kind = None if isinstance(kind, PythonValue) else kind
        if kind is None and self.plain:
            raise make_expected_error(self.words(), raw)
        if kind is None:
            c.at("kind").report(f"{LACKING}; kinds: {', '.join(map(repr, self.names))}")
            raise UnreadableValue
        if not isinstance(kind, str) or kind not in self._find_names(kind):
            near = suggest_names(str(kind)[:64], self.names, "kinds")
            c.at("kind").report(f"no kind {format_value(kind)}; {near}")
            raise UnreadableValue
        return read_table(
            self.family.find(kind), raw, c if old else c.with_old_value(MISSING), "kind"
        )

    def write(self, value: object, c: Context) -> Raw:
        if isinstance(value, str) and value in self.plain:
            return value
        name = self.family.name_of(value)
        if name is None:
            return self._write_other(value, c)
        table = write_table(value, c.with_old_value(MISSING))
        if self.short and not table:
            return name
        return table if name == self.default and not self.short else {"kind": name, **table}

    def keys(self, name: str) -> tuple[str, ...]:
        return (name, *self.beside_of)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> FieldValue:
        beside = [key for key in self.beside_of if key in table]
        raw = table.get(name, (beside and (self.family.name_of(c.over) or self.default)) or MISSING)
        for key in beside:
            if self.beside_of[key][0] != raw:
                c.report(f'{key} is for {name} = "{self.beside_of[key][0]}" only')
        if isinstance(raw, str) and raw == self.none:
            return None
        for key, (kind, at) in self.beside_of.items():
            if kind == raw:
                return self._read_field_beside(self.family.find(raw), at, key, table, c)
        return MISSING if raw is MISSING else self.read_or_report(raw, c.at(name, over=c.over))

    def _read_field_beside(
        self, kind: DeclaredClass, at: str, key: str, table: Mapping[str, Raw], c: Context
    ) -> Any:
        """Return an object of a kind, with one field from a key beside the name."""
        old = c.over if type(c.over) is kind else MISSING
        before, each = c.problems.total_count, replace(find_declared_field(kind, at), name=key)
        inner = c.with_old_value(MISSING if old is MISSING else getattr(old, at))
        value = read_field(each, table, inner)
        if c.problems.total_count > before:
            return MISSING
        own_fields = {} if value is MISSING else {at: value}
        return kind(**own_fields) if old is MISSING else replace(old, **own_fields)

    def put(self, table: dict[str, Raw], name: str, value: object, c: Context) -> None:
        if value is None:
            return
        raw = self.write(value, c.at(name))
        if not isinstance(raw, Mapping) or not self.beside_of:
            table[name] = raw
            return
        kind = raw["kind"]
        own = {at: key for key, (k, at) in self.beside_of.items() if k == kind}
        if raw.keys() - {"kind"} <= own.keys():
            table |= {name: kind, **{own[at]: x for at, x in raw.items() if at != "kind"}}
        else:
            table[name] = raw

    def words(self) -> str:
        return self._words([self.other.words()] if self.other else [])

    def text_words(self) -> str:
        return self._words([self.other.text_words()] if self.other else [])

    def _words(self, more: list[str]) -> str:
        names = map(repr, self._bare_words)
        bare = self.only == () or (self.short and self.names)  # the phrase needs no table
        table = [] if bare else [f"the table of {self._noun_with_article}"]
        return join_alternatives(*names, *more, *table)

    def accepts(self) -> str:
        more = [self.other.accepts()] if self.other else []
        return join_alternatives(*map(repr, self._bare_words), *more, self._noun_with_article)

    def schema(self, define: DefineSchema) -> JSONSchema:
        tables = [define(self.family.find(name), name) for name in self.names]
        if self.default is not None:  # its table may lack `kind`
            tables.append(define(self.family.find(self.default)))
        words = [*self._bare_words, *([self.none] * bool(self.none))]
        enums: list[Any] = [{"enum": words}] if words else []
        more = [self.other.schema(define)] if self.other else []
        return {"anyOf": [*enums, *more, *tables] or [{"type": "object"}]}

    def properties(self, name: str, define: DefineSchema) -> JSONSchema:
        beside = {key: each.spec.schema(define) for key, _, each in self._fields_beside()}
        return {name: self.schema(define), **beside}

    def rows(self, name: str) -> list[tuple[str, str]]:
        beside = [
            (key, f"{each.spec.rows(each.name)[0][1]}; with {name} = {kind!r}")
            for key, kind, each in self._fields_beside()
        ]
        return [(name, self.words()), *beside]

    def _fields_beside(self) -> Iterator[tuple[str, str, DeclaredField]]:
        """Yield the keys beside the name, each with its kind and field."""
        for key, (kind, at) in self.beside_of.items():
            yield key, kind, find_declared_field(self.family.find(kind), at)

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        name = value if isinstance(value, str) else self.family.name_of(value)
        if name is None and self.other is not None and value is not None:
            yield from self.other.controls(value, place)
            return
        key = place if self.short or name in self.plain else place.at("kind", place.meaning)
        offered = self._list_options(name)
        if len(offered) > 1:
            yield key.control("choice", name or self.none, options=offered)
        if name is not None and not isinstance(value, str):
            yield from yield_controls(value, place.with_(f"{place.path}.kind", name))

    @property
    def plain_spec(self) -> Spec:
        return self.other or self

    def parts(self, keys: list[str], value: object, c: Context) -> list[PathPart]:
        if keys == ["kind"]:
            keys.clear()
            return [PathPart(self, c, self.family.name_of, _find_other_kind)]
        if self._is_allowed(value):
            return find_field_parts(get_text_form(type(value)), keys, value, c)
        return [] if self.other is None else self.other.parts(keys, value, c)

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        return () if key == name else (self.beside_of[key][1],)

    def _list_options(self, name: str | None) -> tuple[str, ...]:
        """Return the words that need no table, and the name of the present value."""
        bare = [
            each for each in self.names if not _list_required_parameters(self.family.find(each))
        ]
        none = [self.none] if self.none else []
        words = [*none, *self.plain, *(bare if self.short or not self.plain else [])]
        return tuple(dict.fromkeys([*words, *([name] if name else [])]))

    def make_starters(self) -> dict[str, object]:
        """Return a new object of each kind for which user interfaces need no values.

        A kind with required fields offers their initial values as `starting_values`.
        """
        starters: dict[str, object] = {}
        for name in self.names:
            kind = self.family.find(name)
            values = getattr(kind, "starting_values", {})
            if values.keys() >= set(_list_required_parameters(kind)):
                starters[name] = kind(**values)
        return starters

    def list_inner_classes(self) -> Sequence[DeclaredClass]:
        return [self.family.find(name) for name in self.names]

    def _is_allowed(self, value: Any) -> bool:
        """Return whether a value is of one of the valid kinds."""
        loaded = self.family.loaded.items()
        kinds = [kind for name, kind in loaded if self.only is None or name in self.only]
        return isinstance(value, tuple(kinds))

    def _write_other(self, value: Any, c: Context) -> Raw:
        """Return the text of a value that is not a kind; NoTextError if it is Python code."""
        with suppress(InputError):
            if self.other is not None:
                self.other.check(value, "value")
                return self.other.write(value, c)
        raise NoTextError(f"{type(value).__name__} is Python code")

    def _find_names(self, name: str) -> list[str]:
        if name not in self.family.names:
            with suppress(InputError):
                self.family.find(name)  # also loads the kinds of installed packages
        return self.names

    def _read_other(self, raw: Raw, c: Context) -> Any:
        """Return a value that is not a kind of the family; InputError with the nearest name."""
        if self.other is not None:
            try:
                return self.other.read(raw, c)
            except InputError:
                if not isinstance(raw, str):
                    raise
        near = difflib.get_close_matches(str(raw)[:64], self._bare_words, 1, 0.5)
        guess = f"; did you mean {near[0]!r}?" if near else suggest_decimal_point(raw)
        if isinstance(raw, str) and raw in self.names:  # the kind has required fields
            guess = f', as in {{ kind = "{raw}" }}'
        raise InputError(f"must be {self.text_words()}, got {format_value(raw)}{guess}")

    def _describe_mismatch(self, value: object) -> str:
        hint = ", not the class" if isinstance(value, type) else ""
        return f"expected {self._noun_with_article}{hint}, got {format_value(value)}"

    @property
    def _bare_words(self) -> list[str]:
        """The words that are valid without a table."""
        return [*self.plain, *(self.names if self.short else [])]

    @property
    def _noun_with_article(self) -> str:
        return add_article(self.family.noun)


def _list_required_parameters(kind: DeclaredClass) -> list[str]:
    """Return the names of the required fields."""
    return [each.name for each in fields_of(kind) if each.required]


def _make_default_kind(kind: DeclaredClass, name: str, what: str) -> Any:
    """Return an object of a kind without arguments; InputError if some are required."""
    if needed := _list_required_parameters(kind):
        raise InputError(f"{what}: {name!r} needs {', '.join(needed)}: give a {kind.__name__}(...)")
    return kind()


def _replace_user_fields(value: Any, raw: Mapping[str, Raw], c: Context) -> Any:
    """Return an object of a user's class without a family, with other fields."""
    known = [each.name for each in fields(value) if each.init]
    report_unknown_keys(raw, known, c)
    new_fields = {
        key: x.value if isinstance(x, PythonValue) else x for key, x in raw.items() if key in known
    }
    return replace(value, **new_fields)


def _find_other_kind(owner: Any, name: str) -> Any:
    raise InputError(f"{name}: an object of another kind has other parameters")
