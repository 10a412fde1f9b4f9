"""The declared fields of frozen dataclasses, and the checks that follow from them.

A field is declared by its annotation, `Annotated[type, spec, "What it means."]`. One that no run
depends on has a `Role` beside these.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from enum import Enum
from typing import Any, get_type_hints

from robsim.base.values import Value
from robsim.declare.spec import MISSING, Spec


class Role(Enum):
    """The purpose of a declared field: what changes with it."""

    RUN = "run"
    LABEL = "label"  # what people read: titles, sources, colours
    FIGURE = "figure"  # what figures show: housings, solids of links
    ROBOT = "robot"  # what the controller of a robot does, and no simulation
    FILE = "file"  # what files of other simulators hold: masses, limits of drives


@dataclass(frozen=True)
class Field:
    """A declared field: what it may hold, what it means, and its default."""

    name: str
    spec: Spec
    meaning: str
    default: Any = MISSING
    role: Role = Role.RUN

    @property
    def required(self) -> bool:
        """Whether the field must be given."""
        return self.default is MISSING


def fields_of(kind: type[Any]) -> tuple[Field, ...]:
    """Return the declared fields of a dataclass, in the order of its arguments."""
    if kind not in _FOUND:
        _FOUND[kind] = _found(kind)
    return _FOUND[kind]


_FOUND: dict[type[Any], tuple[Field, ...]] = {}


def _found(kind: type[Any]) -> tuple[Field, ...]:
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for each in dataclasses.fields(kind):
        said = getattr(hints.get(each.name), "__metadata__", ())
        specs = [part for part in said if isinstance(part, Spec)]
        if specs and each.init:
            meaning = next((part for part in said if isinstance(part, str)), "")
            role = next((part for part in said if isinstance(part, Role)), Role.RUN)
            found.append(Field(each.name, specs[0], meaning, _default(each), role))
    return tuple(found)


class Declared(Value):
    """A value that checks its declared fields when it is made."""

    def __post_init__(self) -> None:
        check_fields(self)


def check_fields(value: Any) -> None:
    """Check the declared fields of a new frozen dataclass, and keep them as they should be."""
    kind = type(value).__name__
    for each in fields_of(type(value)):
        given = getattr(value, each.name)
        if given is not None or each.default is not None or each.spec.takes_none:
            checked = each.spec.check(given, f"{kind}.{each.name}")
            object.__setattr__(value, each.name, checked)


def _default(each: dataclasses.Field[Any]) -> Any:
    if each.default is not dataclasses.MISSING:
        return each.default
    if each.default_factory is not dataclasses.MISSING:
        return each.default_factory()
    return MISSING
