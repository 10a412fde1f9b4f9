"""Paths: the dotted names of declared numbers, resolved to get, replace and stack their values.

A path such as "robots.arm.links.deck.dh.alpha" is resolved once, by the declarations of what it
leads through, to a row of parts: `Table`, `ListOf`, `Choice` and other specs give the part under
a key. Every part knows how its owner has another value there, checked as when the owner is made,
or numbers of many runs, which the simulation binds at once.
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
from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.scalars import LARGEST
from robsim.declare.spec import Context, Spec

Shapes = tuple[tuple[int | str, ...], ...]  # of the number of one run


def _replace_whole(owner: Any, new: Any) -> Any:
    """Return what is there instead of an owner that holds nothing else."""
    return new


@dataclass(frozen=True)
class PathPart:
    """A part of a value under one key: what it may hold, and how its owner has another.

    get     value of the part in its owner
    put     owner with another value there, checked
    hold    owner with another value there that is known to be right
    stack   owner with the numbers (runs, ...) of all runs there; None where runs cannot differ
    shapes  shapes that the number of one run may have
    above   what every number is above where runs differ, if anything
    """

    spec: Spec
    c: Context
    get: Callable[[Any], Any]
    put: Callable[[Any, Any], Any]
    hold: Callable[[Any, Any], Any] = _replace_whole
    stack: Callable[[Any, Array], Any] | None = None
    shapes: Shapes = ()
    above: float | None = None
    meaning: str = ""

    def fits(self, shape: tuple[int, ...]) -> bool:
        """Return whether the number of one run may have a shape, where a word is any size."""
        return any(
            len(shape) == len(wanted)
            and all(isinstance(n, str) or n == m for n, m in zip(wanted, shape, strict=True))
            for wanted in self.shapes
        )


@dataclass(frozen=True)
class DottedPath:
    """A dotted name that is resolved: the parts through which it leads."""

    name: str
    parts: tuple[PathPart, ...]

    @property
    def leaf(self) -> PathPart:
        """The part at the end."""
        return self.parts[-1]

    def get(self, value: Any) -> Any:
        """Return what a value has there."""
        for part in self.parts:
            value = part.get(value)
        return value

    def replace(self, value: Any, new: Any) -> Any:
        """Return a copy of a value that has another number there, with every check made."""
        return _replace_at_path(value, self.parts, new)

    def stack(self, value: Any, numbers: Array) -> Any:
        """Return a copy of a value with the numbers (runs, ...) of all runs there."""
        owner = value
        for part in self.parts[:-1]:
            owner = part.get(owner)
        assert self.leaf.stack is not None
        return _stack_at_path(value, self.parts[:-1], self.leaf.stack(owner, numbers))

    def taken(self, given: Any, old: Any) -> Any:
        """Return a number, or an array, as the leaf keeps it; InputError if a file cannot have it.

        A text is what a file would say, a number is in SI.
        """
        spec, c = self.leaf.spec.plain_spec, self.leaf.c
        if isinstance(given, np.generic | np.ndarray):
            given = given.tolist()
        text = isinstance(given, str) or (isinstance(given, list) and isinstance(given[0], str))
        if text or (not spec.united and np.ndim(given) == 0):
            made = spec.read(given, c)
        else:
            if not np.all(np.abs(np.asarray(given, dtype=float)) <= LARGEST):
                raise InputError(
                    f"expected numbers of at most {LARGEST:g}, got {format_value(given)}"
                )
            made = spec.check(given, self.name)
        shape = np.shape(made)
        if not (self.leaf.fits(shape) if self.leaf.shapes else shape == np.shape(old)):
            raise InputError(f"{self.name}: another shape than {np.shape(old)}")
        return made


def resolve_path(spec: Spec, value: Any, name: str, c: Context) -> DottedPath | None:
    """Return the path of a dotted name within a value that a spec declares; None if none leads.

    Through what does not stand there, such as the parameters of another kind, no path leads.
    """
    keys, parts = name.split("."), list[PathPart]()
    while keys:
        found = spec.parts(keys, value, c)
        if not found:
            return None
        parts += found
        for part in found if keys else ():
            value, spec, c = part.get(value), part.spec, part.c
    return DottedPath(name, tuple(parts))


def find_field_parts(form: type[Any], keys: list[str], value: Any, c: Context) -> list[PathPart]:
    """Return the part of a declared object under the first of these keys, which is taken away."""
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


def _find_owner_field(form: type[Any], key: str) -> DeclaredField | None:
    """Return the field to which a key of the table of a class belongs."""
    if form not in _OWNERS:
        _OWNERS[form] = {key: f for f in fields_of(form) for key in f.spec.keys(f.name)}
    return _OWNERS[form].get(key)


_OWNERS: dict[type[Any], dict[str, DeclaredField]] = {}


def get_inner_context(form: type[Any], value: Any, c: Context) -> Context:
    """Return the context inside of the table of an object."""
    own = _LazyFields(value, form)
    inner = c.knowing(own=own, raw={})
    return form.facts(own, inner) if hasattr(form, "facts") else inner


class _LazyFields(dict[str, Any]):
    """The fields of an object by name, each looked up when it is asked for."""

    def __init__(self, value: Any, form: type[Any]):
        super().__init__()
        self.value = value
        self.stands = {} if form is type(value) else getattr(form, "stands", {})

    def __missing__(self, name: str) -> Any:
        return attrgetter(self.stands.get(name, name))(self.value)

    def get(self, name: str, default: Any = None) -> Any:
        """Return a field; the default where the object has none of this name."""
        try:
            return self[name]
        except AttributeError:
            return default


def make_field_part(form: type[Any], each: DeclaredField, value: Any, c: Context) -> PathPart:
    """Return the part of a field, of the object itself or of the form that says it."""
    stands: Mapping[str, str] = {} if form is type(value) else getattr(form, "stands", {})
    name, spec = each.name, each.spec
    if form is not type(value) and hasattr(form, "of") and name not in stands:
        return PathPart(
            spec,
            c,
            lambda owner: getattr(form.of(owner, c), name),
            lambda owner, new: replace(form.of(owner, c), **{name: new}).made(c),
            meaning=each.meaning,
        )
    at = stands.get(name, name)
    keys = at.split(".") if at else []
    if not keys:
        return PathPart(spec, c, lambda owner: owner, _replace_whole)
    hold = _make_setter(keys, replace_stacked)
    part = PathPart(
        spec, c, attrgetter(at), _make_setter(keys, replace_checked), hold, meaning=each.meaning
    )
    if each.stacked is None:
        return part
    shaped = each.stacked
    part = replace(part, shapes=shaped.shapes, above=shaped.above)
    return replace(part, stack=lambda owner, x: hold(owner, shaped.bound(x)))


def _make_setter(keys: Sequence[str], way: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    """Return what gives an object another value at attributes of attributes."""

    def put(owner: Any, new: Any) -> Any:
        if len(keys) > 1:
            new = _make_setter(keys[1:], way)(getattr(owner, keys[0]), new)
        return way(owner, **{keys[0]: new})

    return put


def replace_checked(value: Any, **changes: Any) -> Any:
    """Return a copy with other fields, all of which are checked.

    A class whose making takes long may know what to check again: its method `replace_checked`.
    """
    own = getattr(value, "revised", None)
    return own(**changes) if own is not None else replace(value, **changes)


def replace_stacked(value: Any, **changes: Any) -> Any:
    """Return a copy with other fields, which are known to be right, or numbers of many runs.

    A class of which more follows from these has a method `replace_stacked`.
    """
    own = getattr(value, "held", None)
    return own(**changes) if own is not None else replace_unchecked(value, **changes)


def make_item_part(spec: Spec, number: int, c: Context) -> PathPart:
    """Return the part of a tuple at a place."""

    def put(owner: Any, new: Any) -> Any:
        return (*owner[:number], new, *owner[number + 1 :])

    return PathPart(spec, c, lambda owner: owner[number], put, put)


def _replace_at_path(value: Any, parts: Sequence[PathPart], new: Any) -> Any:
    if not parts:
        return new
    head, *rest = parts
    return head.put(value, _replace_at_path(head.get(value), rest, new) if rest else new)


def _stack_at_path(value: Any, parts: Sequence[PathPart], new: Any) -> Any:
    if not parts:
        return new
    head, *rest = parts
    return head.hold(value, _stack_at_path(head.get(value), rest, new))
