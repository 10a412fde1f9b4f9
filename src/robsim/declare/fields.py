"""Declared fields of frozen dataclasses, and the checks of their values.

A field is declared by its annotation, `Annotated[type, spec, "Meaning."]`. A field without effect
on a run also has a `Role` there.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any, get_type_hints

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare.context import MISSING, FieldValue
from robsim.declare.spec import DeclaredClass, Spec


@dataclass(frozen=True, init=False)
class PerRun:
    """Annotation of a field with a number that may differ from run to run.

    A stage gets such a number as an array with the runs on the last axis.

    Parameters
    ----------
    *shapes : tuple of (int or str)
        Valid shapes of the number of one run. A word stands for any size.
    rows : bool, default False
        Whether the stage takes a two-dimensional array, with a row for each number.
    above : float, optional
        Bound that all numbers exceed if runs differ.

    Examples
    --------
    >>> PerRun(()).bound(np.zeros(5)).shape
    (5,)
    """

    shapes: tuple[tuple[int | str, ...], ...]
    rows: bool
    above: float | None

    def __init__(
        self, *shapes: tuple[int | str, ...], rows: bool = False, above: float | None = None
    ):
        vars(self).update(shapes=shapes, rows=rows, above=above)

    def bound(self, values: Array) -> Array:
        """Return numbers (runs, ...) in the shape for a stage, read-only."""
        runs_last = np.ascontiguousarray(np.moveaxis(values, 0, -1))
        return make_read_only(np.atleast_2d(runs_last) if self.rows else runs_last)


class Role(Enum):
    """Purpose of a declared field: the outputs that depend on it.

    Examples
    --------
    >>> [role.value for role in Role]
    ['run', 'label', 'figure', 'robot', 'message', 'file', 'drive']
    """

    RUN = "run"
    LABEL = "label"  # texts for people: titles, sources, colours
    FIGURE = "figure"  # content of figures and pictures: housings, solids of links
    ROBOT = "robot"  # behaviour of a controller on a robot, not of a simulation
    MESSAGE = "message"  # messages of a robot on a network, not a simulation: topics and names
    FILE = "file"  # content of files for other simulators only: names of meshes, speeds of joints
    DRIVE = "drive"  # dynamics, without effect on joints without a drive: masses, friction


@dataclass(frozen=True)
class DeclaredField:
    """A declared field: name, spec, meaning, default and role.

    `stacked` is set if its number may differ from run to run.
    """

    name: str
    spec: Spec
    meaning: str
    default: FieldValue = MISSING
    stacked: PerRun | None = None
    role: Role = Role.RUN

    @property
    def required(self) -> bool:
        """Whether the field has no default."""
        return self.default is MISSING

    @cached_property
    def checked_default(self) -> FieldValue:
        """The default as an object stores it; no known value if there is no valid default."""
        if self.default is None and not self.spec.takes_none:
            return None
        with suppress(InputError):
            return self.spec.check(self.default, self.name)
        return object()


def fields_of(kind: DeclaredClass) -> tuple[DeclaredField, ...]:
    """Return the declared fields of a dataclass, in the order of its arguments.

    >>> from robsim import IBVS
    >>> "gain" in [each.name for each in fields_of(IBVS)]
    True
    """
    if kind not in _FOUND:
        _FOUND[kind] = tuple(_yield_fields(kind))
    return _FOUND[kind]


_FOUND: dict[DeclaredClass, tuple[DeclaredField, ...]] = {}


def _yield_fields(kind: DeclaredClass) -> Iterator[DeclaredField]:
    if not dataclasses.is_dataclass(kind):
        return
    hints = get_type_hints(kind, include_extras=True)
    for each in dataclasses.fields(kind):
        metadata = getattr(hints.get(each.name), "__metadata__", ())
        specs = [part for part in metadata if isinstance(part, Spec)]
        if specs and each.init:
            meaning = next((part for part in metadata if isinstance(part, str)), "")
            stacked = next((part for part in metadata if isinstance(part, PerRun)), None)
            role = next((part for part in metadata if isinstance(part, Role)), Role.RUN)
            yield DeclaredField(each.name, specs[0], meaning, get_default(each), stacked, role)


class DeclaredValue(Value):
    """Base of frozen dataclasses that check their declared fields when they are created.

    Instances are compared and hashed by value, arrays included.

    Examples
    --------
    >>> from robsim.tasks import NearBorder
    >>> NearBorder(10.0, (640, 480)) == NearBorder(10.0, (640, 480))
    True
    >>> NearBorder(-1.0, (640, 480))
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: NearBorder.margin must be a positive number (px), got -1.0
    """

    def __post_init__(self) -> None:
        check_fields(self)


def check_fields(value: object) -> None:
    """Check the declared fields of a new frozen dataclass, and store the checked values.

    Call it in `__post_init__` of a class that does not derive from `DeclaredValue`.

    >>> from robsim.endings import Region
    >>> region = Region("arm.tool", low=(0, 0, 0), high=(1, 1, 1))
    >>> check_fields(region) is None
    True
    """
    kind = type(value).__name__
    for each in fields_of(type(value)):
        field_value = getattr(value, each.name)
        if each.required or field_value is not each.checked_default:
            checked = each.spec.check(field_value, f"{kind}.{each.name}")
            object.__setattr__(value, each.name, checked)


def get_default(each: dataclasses.Field[Any]) -> Any:
    """Return the default of a field; MISSING if it has none."""
    if each.default_factory is not dataclasses.MISSING:
        return each.default_factory()
    return MISSING if each.default is dataclasses.MISSING else each.default


def is_identical(a: Any, b: Any) -> bool:
    """Return whether two values are identical to the last bit: -0.0 differs from 0.0."""
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
    """Return whether a field has its default value."""
    defaults = () if each.required else (each.default, each.checked_default)
    return any(is_identical(default, value) for default in defaults)
