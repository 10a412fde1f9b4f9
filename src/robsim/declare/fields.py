"""The declared fields of frozen dataclasses, and the checks that follow from them.

A field is declared by its annotation, `Annotated[type, spec, "What it means."]`. One that no run
depends on has a `Role` beside these.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, get_type_hints

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare.spec import MISSING, Spec


@dataclass(frozen=True, init=False)
class PerRun:
    """The mark of a field whose number may differ from run to run, in the shapes of one run.

    A stage then takes it as an array with the runs last, of `rows` where it has rows. Where runs
    differ, each number is `above` another, if one is given.
    """

    shapes: tuple[tuple[int | str, ...], ...]
    rows: bool
    above: float | None

    def __init__(
        self, *shapes: tuple[int | str, ...], rows: bool = False, above: float | None = None
    ):
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "above", above)

    def bound(self, values: Array) -> Array:
        """Return numbers (runs, ...) as a stage takes them, read-only."""
        runs_last = np.ascontiguousarray(np.moveaxis(values, 0, -1))
        return make_read_only(np.atleast_2d(runs_last) if self.rows else runs_last)


class Role(Enum):
    """The purpose of a declared field: what changes with it."""

    RUN = "run"
    LABEL = "label"  # what people read: titles, sources, colours
    FIGURE = "figure"  # what figures show: housings, solids of links
    ROBOT = "robot"  # what the controller of a robot does, and no simulation
    FILE = "file"  # what files of other simulators hold: masses, limits of drives


@dataclass(frozen=True)
class DeclaredField:
    """A declared field: what it may hold, what it means, and its default.

    `stacked` says that its number may differ from run to run.
    """

    name: str
    spec: Spec
    meaning: str
    default: Any = MISSING
    stacked: PerRun | None = None
    role: Role = Role.RUN

    @property
    def required(self) -> bool:
        """Whether the field must be given."""
        return self.default is MISSING


def fields_of(kind: type[Any]) -> tuple[DeclaredField, ...]:
    """Return the declared fields of a dataclass, in the order of its arguments."""
    if kind not in _FOUND:
        _FOUND[kind] = _collect_fields(kind)
    return _FOUND[kind]


_FOUND: dict[type[Any], tuple[DeclaredField, ...]] = {}


def _collect_fields(kind: type[Any]) -> tuple[DeclaredField, ...]:
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for each in dataclasses.fields(kind):
        said = getattr(hints.get(each.name), "__metadata__", ())
        specs = [part for part in said if isinstance(part, Spec)]
        if specs and each.init:
            meaning = next((part for part in said if isinstance(part, str)), "")
            stacked = next((part for part in said if isinstance(part, PerRun)), None)
            role = next((part for part in said if isinstance(part, Role)), Role.RUN)
            found.append(
                DeclaredField(each.name, specs[0], meaning, _get_default(each), stacked, role)
            )
    return tuple(found)


class DeclaredValue(Value):
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


def _get_default(each: dataclasses.Field[Any]) -> Any:
    if each.default is not dataclasses.MISSING:
        return each.default
    if each.default_factory is not dataclasses.MISSING:
        return each.default_factory()
    return MISSING


def is_identical(a: Any, b: Any) -> bool:
    """Return whether two values are one to the last bit: -0.0 is not 0.0."""
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return a == b and math.copysign(1.0, a) == math.copysign(1.0, b)
    if hasattr(a, "__array__"):  # an array, or a pose
        a, b = np.asarray(a), np.asarray(b)
        return (a.shape, a.dtype, a.tobytes()) == (b.shape, b.dtype, b.tobytes())
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(is_identical, a, b))
    if dataclasses.is_dataclass(a) and a is not b:
        own = [each.name for each in dataclasses.fields(a) if each.compare]
        return all(is_identical(getattr(a, name), getattr(b, name)) for name in own)
    return a is b or bool(a == b)


def is_default(each: DeclaredField, value: Any) -> bool:
    """Return whether a field has the value that it has where a text says nothing."""
    if each.required or is_identical(each.default, value):
        return not each.required
    if each.default is None and not each.spec.takes_none:
        return False
    try:
        return is_identical(each.spec.check(each.default, each.name), value)
    except InputError:
        return False
