"""Immutable values with arrays, which are compared and hashed by content."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import cached_property
from typing import Any, TypeVar

import numpy as np


class Value:
    """Base of frozen dataclasses with `eq=False`, compared and hashed with their arrays."""

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    @cached_property
    def holds_still(self) -> bool:
        """Whether the value is immutable; a part of a user's class is not."""
        return _is_own_immutable(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            _freeze_arrays(value)  # arrays of copies are read-only too
        self.__dict__.update(state)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def _key(self) -> tuple[Any, ...]:
        compared = (f.name for f in fields(self) if f.compare)  # type: ignore[arg-type]
        return tuple(make_hashable(getattr(self, name)) for name in compared)


class ReadOnlyDict(dict[str, Any]):
    """A dict of which no item can change.

    >>> ReadOnlyDict(a=1.0) == {"a": 1.0}
    True
    """

    def _refuse(self, *args: Any, **named: Any) -> Any:
        raise TypeError("this dict is read-only: make a new value with another dict")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)


T = TypeVar("T")


def replace_unchecked(value: T, **changes: Any) -> T:
    """Return a copy of a frozen dataclass with other fields, which are known to be valid."""
    old_fields = {each.name: getattr(value, each.name) for each in fields(value)}  # type: ignore[arg-type]
    return construct_unchecked(type(value), **{**old_fields, **changes})


def copy_cached(old: Any, new: Any, names: Iterable[str]) -> None:
    """Copy cached properties with these names from an old value to a new one."""
    vars(new).update({name: vars(old)[name] for name in names if name in vars(old)})


def construct_unchecked(kind: type[T], /, **values: Any) -> T:
    """Return a dataclass from values that are known to be valid, without its checks.

    Missing fields must have plain defaults.
    """
    value = object.__new__(kind)
    value.__dict__.update(values)
    return value


def _freeze_arrays(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    for part in value.values() if isinstance(value, dict) else ():
        _freeze_arrays(part)


def make_hashable(value: Any) -> Any:
    """Return a hashable equivalent of a value; arrays are replaced by their shape and bytes."""
    if isinstance(value, dict):
        return tuple((key, make_hashable(part)) for key, part in sorted(value.items()))
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0.0).tobytes()  # -0.0 becomes 0.0, which it equals
    return value


def is_immutable(value: Any) -> bool:
    """Return whether a value is immutable: a number, a text, a read-only array, or our own type.

    Objects of a user's class count as mutable.

    >>> is_immutable((1.0, "a", None)), is_immutable(np.zeros(2)), is_immutable([1.0])
    (True, False, False)
    """
    if value is None or isinstance(value, str | int | float):
        return True
    if isinstance(value, np.ndarray):
        return not value.flags.writeable
    if isinstance(value, tuple):
        return all(map(is_immutable, value))
    if isinstance(value, ReadOnlyDict):
        return all(map(is_immutable, value.values()))
    return value.holds_still if isinstance(value, Value) else _is_own_immutable(value)


def _is_own_immutable(value: Any) -> bool:
    """Return whether a value of our own class, frozen or with slots, has immutable parts."""
    kind: Any = type(value)
    params = getattr(kind, "__dataclass_params__", None)
    if not kind.__module__.startswith("robsim.") or (params and not params.frozen):
        return False
    names = [f.name for f in fields(kind)] if params else getattr(kind, "__slots__", None)
    return names is not None and all(is_immutable(getattr(value, name)) for name in names)
