"""Paths: dotted names of declared numbers, resolved to get, replace and stack their values.

A path such as "robots.arm.links.deck.dh.alpha" is resolved once to a sequence of parts: the specs
(`Table`, `ListOf`, `KindOf` and others) return the part for a key. A part can replace its value in
the owner, with the checks of the owner, or insert the numbers of many runs, which are simulated
together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.value import replace_unchecked
from robsim.declare.context import Context, FieldValue
from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.scalars import LARGEST
from robsim.declare.spec import DeclaredClass, PathPart, Spec, replace_whole


@dataclass(frozen=True)
class DottedPath:
    """A resolved dotted name: a sequence of parts."""

    name: str
    parts: tuple[PathPart, ...]

    @property
    def leaf(self) -> PathPart:
        """The last part."""
        return self.parts[-1]

    def get(self, value: Any) -> Any:
        """Return the number of a value at this path."""
        for part in self.parts:
            value = part.get(value)
        return value

    def replace(self, value: Any, new: Any) -> Any:
        """Return a copy of a value with another number at this path, checked."""
        owners = self._list_owners(value)
        for part in reversed(self.parts):
            new = part.put(owners.pop(), new)
        return new

    def stack(self, value: Any, numbers: Array) -> Any:
        """Return a copy of a value with the numbers (runs, ...) of all runs at this path."""
        owners = self._list_owners(value)
        assert self.leaf.stack is not None
        stacked = self.leaf.stack(owners.pop(), numbers)
        for part in reversed(self.parts[:-1]):
            stacked = part.hold(owners.pop(), stacked)
        return stacked

    def _list_owners(self, value: Any) -> list[Any]:
        """Return the object that contains each part: the value itself first."""
        owners = [value]
        for part in self.parts[:-1]:
            owners.append(part.get(owners[-1]))
        return owners

    def convert_leaf_value(self, value: FieldValue, old: Any) -> FieldValue:
        """Return a number or array as the leaf stores it; InputError if a file cannot hold it.

        A text is parsed as in a file; a number is in SI units.
        """
        spec, c = self.leaf.spec.plain_spec, self.leaf.c
        if isinstance(value, np.generic | np.ndarray):
            value = value.tolist()
        text = isinstance(value, str) or (isinstance(value, list) and isinstance(value[0], str))
        if text or (not spec.united and np.ndim(value) == 0):
            checked = spec.read(value, c)
        else:
            if not np.all(np.abs(np.asarray(value, dtype=float)) <= LARGEST):
                raise InputError(
                    f"expected numbers of at most {LARGEST:g}, got {format_value(value)}"
                )
            checked = spec.check(value, self.name)
        shape = np.shape(checked)
        if not (self.leaf.fits(shape) if self.leaf.shapes else shape == np.shape(old)):
            raise InputError(f"{self.name}: another shape than {np.shape(old)}")
        return checked


def resolve_path(spec: Spec, value: Any, name: str, c: Context) -> DottedPath | None:
    """Return the path of a dotted name within a declared value; None if there is no such path.

    A path contains present parts only, no parameters of another kind.
    """
    keys, parts = name.split("."), list[PathPart]()
    while keys:
        inner_parts = spec.parts(keys, value, c)
        if not inner_parts:
            return None
        parts += inner_parts
        for part in inner_parts if keys else ():
            value, spec, c = part.get(value), part.spec, part.c
    return DottedPath(name, tuple(parts))


def find_field_parts(
    form: DeclaredClass, keys: list[str], value: Any, c: Context
) -> list[PathPart]:
    """Return the part of a declared object under the first key, and remove it from the keys."""
    each = _find_owner_field(form, keys[0])
    if each is None:
        return []
    key = keys.pop(0)
    part = make_field_part(form, each, value, get_inner_context(form, value, c).at(key))
    inner = each.spec.inner(each.name, key)
    if not inner:
        return [part]
    more = each.spec.parts(list(inner), part.get(value), part.c)
    return [part, *(more if each.stacked else [replace(one, stack=None) for one in more])]


def _find_owner_field(form: DeclaredClass, key: str) -> DeclaredField | None:
    """Return the field that owns a key in the table of a class."""
    if form not in _OWNERS:
        _OWNERS[form] = {key: f for f in fields_of(form) for key in f.spec.keys(f.name)}
    return _OWNERS[form].get(key)


_OWNERS: dict[DeclaredClass, dict[str, DeclaredField]] = {}


def get_inner_context(form: DeclaredClass, value: Any, c: Context) -> Context:
    """Return the context inside the table of an object."""
    own = _LazyFields(value, _get_attributes(form, value))
    inner = c.with_facts(own=own, raw={})
    return form.facts(own, inner) if hasattr(form, "facts") else inner


@dataclass(frozen=True)
class _LazyFields:
    """The fields of an object by name, each looked up when it is used."""

    value: Any
    attributes: Mapping[str, str]

    def get(self, name: str, default: Any = None) -> Any:
        """Return a field; the default if the object lacks it."""
        try:
            return attrgetter(self.attributes.get(name, name))(self.value)
        except AttributeError:
            return default


def _get_attributes(form: DeclaredClass, value: Any) -> Mapping[str, str]:
    """Return the attributes of an object that stand for fields of its text form, by field."""
    return {} if form is type(value) else getattr(form, "stands", {})


def make_field_part(form: DeclaredClass, each: DeclaredField, value: Any, c: Context) -> PathPart:
    """Return the part of a field, of an object or of the form that represents it in texts."""
    stands, name, spec = _get_attributes(form, value), each.name, each.spec
    if form is not type(value) and hasattr(form, "of") and name not in stands:
        return PathPart(
            spec,
            c,
            lambda owner: getattr(form.of(owner, c), name),
            lambda owner, new: replace(form.of(owner, c), **{name: new}).build_value(c),
            meaning=each.meaning,
        )
    at = stands.get(name, name)
    keys = at.split(".") if at else []
    if not keys:
        return PathPart(spec, c, lambda owner: owner, replace_whole)
    hold = _make_setter(keys, replace_stacked)
    part = PathPart(
        spec, c, attrgetter(at), _make_setter(keys, replace_checked), hold, meaning=each.meaning
    )
    if each.stacked is None:
        return part
    stacked = each.stacked
    part = replace(part, shapes=stacked.shapes, above=stacked.above)
    return replace(part, stack=lambda owner, x: hold(owner, stacked.bound(x)))


def _make_setter(keys: Sequence[str], way: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    """Return a function that replaces a nested attribute of an object."""

    def put(owner: Any, new: Any) -> Any:
        if len(keys) > 1:
            new = _make_setter(keys[1:], way)(getattr(owner, keys[0]), new)
        return way(owner, **{keys[0]: new})

    return put


def replace_checked(value: Any, **changes: Any) -> Any:
    """Return a copy with other fields, all checked.

    A class with an expensive constructor may define a method `revised`, which checks only the
    changes.
    """
    own = getattr(value, "revised", None)
    return own(**changes) if own is not None else replace(value, **changes)


def replace_stacked(value: Any, **changes: Any) -> Any:
    """Return a copy with other fields that are known to be valid, or that hold many runs.

    A class with values that depend on these fields defines a method `held`.
    """
    own = getattr(value, "held", None)
    return own(**changes) if own is not None else replace_unchecked(value, **changes)


def make_item_part(spec: Spec, number: int, c: Context) -> PathPart:
    """Return the part of a tuple at an index."""

    def put(owner: Any, new: Any) -> Any:
        return (*owner[:number], new, *owner[number + 1 :])

    return PathPart(spec, c, lambda owner: owner[number], put, put)
