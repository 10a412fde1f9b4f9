"""Families: the kinds of one sort of thing, by the names that texts use.

A user's kind joins a family by `register`, or as an entry point of the group "robsim" whose
object is the class, decorated likewise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import Any, TypeVar

from robsim.base.errors import InputError, said, suggest
from robsim.base.names import checked_name
from robsim.declare.parameters import described

K = TypeVar("K", bound=type[Any])
_FAMILIES: dict[str, Family] = {}


@dataclass
class Family:
    """The kinds of one sort of thing, such as the "feature" or "law" of its `noun`."""

    noun: str
    kinds: dict[str, type[Any]] = field(default_factory=dict)

    def find(self, name: object) -> type[Any]:
        """Return the class of that name; InputError with the nearest, and all there are."""
        if not isinstance(name, str) or name not in self.kinds:
            _load_entry_points()
        if not isinstance(name, str) or name not in self.kinds:
            hint = suggest(str(name)[:64], self.kinds, plural(self.noun))
            raise InputError(f"no {self.noun} {said(name)}; {hint}")
        return self.kinds[name]

    def name_of(self, value: object) -> str | None:
        """Return the name of the class of a value; None if it does not belong here."""
        names = (name for name, kind in self.kinds.items() if type(value) is kind)
        return next(names, None)

    def holds(self, value: object) -> bool:
        """Return whether a value is of one of these kinds."""
        return isinstance(value, tuple(self.kinds.values()))


def plural(noun: str) -> str:
    """Return the plural of the noun of a family.

    >>> plural("law"), plural("trajectory"), plural("kind of moments")
    ('laws', 'trajectories', 'kinds of moments')
    """
    head, of, tail = noun.partition(" of ")
    many = f"{head[:-1]}ies" if head.endswith("y") else f"{head}s"
    return many.replace("matrixs", "matrices") + of + tail


def family(noun: str) -> Family:
    """Return the family of that noun, which is made when it is first asked for."""
    return _FAMILIES.setdefault(noun, Family(noun))


def families() -> dict[str, Family]:
    """Return all families by their nouns."""
    _load_shipped()
    return dict(_FAMILIES)


def register(noun: str, name: str | None = None) -> Callable[[K], K]:
    """Return a decorator that gives a class its name in a family, such as ("feature", "points").

    Without a name the class has that of its attribute `name`. Its docstring gets a list of its
    parameters, as by `described`.

    InputError: there is no such family, the name cannot be one, or another class has it.
    """

    def named(kind: K) -> K:
        if not isinstance(kind, type):
            raise InputError(f"{noun}: expected a class, got {said(kind)}")
        own = checked_name(getattr(kind, "name", None) if name is None else name, noun)
        if not kind.__module__.startswith("robsim."):
            _load_shipped()
        elif noun not in _FAMILIES:
            family(noun)  # whose own module may be imported after those of its kinds
        if noun not in _FAMILIES:
            raise InputError(f"no family {said(noun)}; {suggest(noun, _FAMILIES, 'families')}")
        known = _FAMILIES[noun].kinds.get(own)
        if known is not None and known.__qualname__ != kind.__qualname__:
            raise InputError(f"there is a {noun} {own!r} already: {known.__qualname__}")
        _FAMILIES[noun].kinds[own] = kind
        return described(kind)

    return named


@cache
def _load_shipped() -> None:
    """Import every kind of RobSim, once, so that a user's meets the families and their names.

    The module of what a file may say imports them all; it lies above this one, as users' do.
    """
    import_module("robsim.studies.text")


@cache
def _load_entry_points() -> None:
    """Import what installed packages bring, once: their decorators do the rest."""
    from importlib.metadata import entry_points

    for point in entry_points(group="robsim"):
        point.load()
