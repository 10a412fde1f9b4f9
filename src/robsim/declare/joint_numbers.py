"""Numbers of joints, each in the unit of its joint, which the scene defines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robsim.base.arrays import Array, as_one_or_each, make_read_only
from robsim.base.errors import InputError
from robsim.base.si_units import make_quantity_pattern
from robsim.declare.array_types import Numbers
from robsim.declare.context import Context, FieldValue, NoTextError, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.exact_quantity import ExactQuantity
from robsim.declare.problems import UnreadableValue, join_keys, prefix_path
from robsim.declare.quantities import DIMENSIONS, format_examples, read_quantity
from robsim.declare.scalars import POSITIVE, Number
from robsim.declare.spec import DefineSchema, JSONSchema, make_expected_error

NOUNS = {"": "coordinates", "/s": "velocities", "/s^2": "accelerations"}


class Axes(NamedTuple):
    """The units and names of the coordinates or velocities of joints."""

    units: Sequence[str]
    names: Sequence[str]


AxesOf = Callable[[Context], Axes | None]  # None if the scene is not known


def get_coordinate_axes(c: Context) -> Axes | None:
    """Return the axes of the coordinates of the scene."""
    scene = c.facts.get("scene")
    return None if scene is None else Axes(scene.coordinate_units, scene.coordinate_names)


def get_velocity_axes(c: Context) -> Axes | None:
    """Return the axes of the velocities of the scene."""
    scene = c.facts.get("scene")
    return None if scene is None else Axes(scene.velocity_units, scene.velocity_names)


def get_commanded_axes(c: Context) -> Axes | None:
    """Return the axes of the velocities that the task commands; None while it is read."""
    known = c.facts.get("commanded")
    try:
        return known() if known else None
    except InputError:
        return None  # the task does not fit the scene


def get_followed_axes(c: Context) -> Axes | None:
    """Return the axes of the coordinates of the joints that the task follows."""
    axes: Axes | None = c.facts.get("followed")
    return axes


@dataclass(frozen=True)
class PerJoint(Numbers):
    """A list of one number for each joint, which becomes an array.

    `per` is "" for coordinates, "/s" for velocities and "/s^2" for accelerations. With `later`, the
    joints are known only after the task is read: until then a number may have the unit of any
    joint, and `check_deferred_numbers` does the final check.
    """

    axes: AxesOf
    per: str = ""
    later: bool = False
    united: ClassVar[bool] = True
    json: ClassVar[Mapping[str, Any]] = {"type": "array", "items": {"type": ["string", "number"]}}

    @property
    def of_any(self) -> tuple[str, ...]:
        """The possible units of a number, for any joint."""
        return f"rad{self.per}", f"m{self.per}"

    def axes_at(self, c: Context) -> Axes | None:
        """Return the joints with the unit of each number; None if they are not known."""
        axes = self.axes(c)
        return axes and Axes([f"{u.removesuffix('/s')}{self.per}" for u in axes.units], axes.names)

    def read(self, raw: Raw, c: Context) -> FieldValue:
        if not isinstance(raw, list):
            raise make_expected_error("a list", raw)
        return list(self.read_each(dict(enumerate(raw)), c).values())

    def read_each(self, raw: Mapping[Any, Raw], c: Context) -> dict[Any, float]:
        """Return numbers by their keys, each in the unit of its joint."""
        axes = self.axes_at(c)
        if axes is None and not self.later:
            raise UnreadableValue  # an error of the scene or robot is reported already
        if axes is None:
            c.facts["later"].append((self, raw, c))
        elif len(raw) != len(axes.units):
            names = ", ".join(axes.names) or "none"
            raise InputError(f"{len(raw)} {NOUNS[self.per]}, expected {len(axes.units)}: {names}")
        values, units = {}, [(unit,) for unit in axes.units] if axes else [self.of_any] * len(raw)
        for (key, text), of in zip(raw.items(), units, strict=True):
            with prefix_path(key):
                values[key] = self.read_one(text, *of)
        return values

    def read_one(self, raw: Raw, *of: str) -> Any:
        """Return a number in SI from a text in one of these units."""
        return self.item.require_valid(read_quantity(raw, *of), raw)

    def write(self, value: FieldValue, c: Context) -> FieldValue:
        axes = self.axes_at(c) or Axes((), ())
        if np.shape(value) != (len(axes.units),):
            wrong = f"not one number for each of {len(axes.units)} joints"
            raise NoTextError(
                f"{join_keys(*c.path)} is {'Python code' if callable(value) else wrong}"
            )
        return [ExactQuantity(x, unit) for x, unit in zip(value, axes.units, strict=True)]

    def _describe_list(self, words: str) -> str:
        return f"one number for each joint, as in {format_examples(*self.of_any)}"

    def controls(self, value: FieldValue, place: ControlPlace) -> Iterable[Control]:
        axes = self.axes_at(place.c)
        if axes is None or np.shape(value) != (len(axes.units),):
            return ()
        limits = place.c.facts["scene"].limits if self.axes is get_coordinate_axes else None
        return [place.several(value, tuple(axes.names), tuple(axes.units), limits=limits)]


@dataclass(frozen=True)
class OneOrEach(PerJoint):
    """A number for all joints, or a list of one for each, which becomes a tuple."""

    item: Number = field(default=POSITIVE, kw_only=True)  # or of at least 0
    forms: ClassVar[tuple[str, ...]] = ("plain", "list")

    def find_violation(self, value: object) -> str:
        return ""  # `convert_python_value` has checked it

    def convert_python_value(self, value: FieldValue, what: str) -> FieldValue:
        return as_one_or_each(value, what, "joint", zero=self.item.least == 0)

    def read(self, raw: Raw, c: Context) -> FieldValue:
        if isinstance(raw, list):
            return tuple(super().read(raw, c))
        if not isinstance(raw, str | int | float):
            raise make_expected_error(self.words(), raw)
        return self.read_one(raw, *(self._kinds(c) or self.of_any))

    def write(self, value: FieldValue, c: Context) -> FieldValue:
        if isinstance(value, tuple):
            return super().write(value, c)
        unit = (self._kinds(c) or self.of_any)[0]  # the unit of the first joint
        return ExactQuantity(value, unit)

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        kinds = self._kinds(place.c)
        if isinstance(value, float) and kinds:  # in the unit of the first joint
            return [place.slider(value, kinds[0], 0.0, None, True)]
        return super().controls(value, place)

    def _describe_list(self, words: str) -> str:
        example = format_examples(*self.of_any)
        return f"one number with its unit for all, as in {example}, or a list of one for each"

    def accepts(self) -> str:
        return f"{self.item.words()}, or one for each joint"

    def schema(self, define: DefineSchema) -> JSONSchema:
        patterns = [make_quantity_pattern(DIMENSIONS[unit]) for unit in self.of_any]
        for_all = [{"type": "string", "pattern": each} for each in patterns]
        return {"anyOf": [*for_all, super().schema(define)]}

    def _kinds(self, c: Context) -> list[str]:
        """Return the distinct units of the joints, without "1"."""
        axes = self.axes_at(c)
        return [unit for unit in dict.fromkeys(axes.units if axes else ()) if unit != "1"]


@dataclass(frozen=True)
class OfJoint(Number):
    """A number in the unit of the joint that contains it; `per` is "" or "/s"."""

    per: str = ""
    united: ClassVar[bool] = True
    json: ClassVar[Mapping[str, Any]] = {"type": "string"}

    def parse_text_value(self, raw: Raw, c: Context) -> FieldValue:
        return read_quantity(raw, f"{get_joint_unit(c)}{self.per}")

    def write(self, value: FieldValue, c: Context) -> str:
        return ExactQuantity(value, f"{get_joint_unit(c)}{self.per}")

    def words(self) -> str:
        return f"{super().words()} in the unit of the joint{self.per}"


def get_joint_unit(c: Context) -> str:
    """Return the unit of the single coordinate of a joint; InputError for other joints."""
    kind = c.facts["joint"]
    if kind is None:
        raise UnreadableValue
    if len(kind.units) != 1:
        raise InputError(
            f"a {kind.name} joint has no such number; only joints with one coordinate have it"
        )
    unit: str = kind.units[0]
    return unit


def has_wrong_count(numbers: Any, owners: Sequence[str]) -> bool:
    """Return whether numbers for each owner have a wrong count.

    One number for all owners, or one for each run, is valid. If runs differ, numbers have the
    shape (n, runs).
    """
    return (isinstance(numbers, tuple) or np.ndim(numbers) > 1) and len(numbers) != len(owners)


def check_joint_count(numbers: Any, name: str, owners: Sequence[str]) -> None:
    """Raise InputError unless there is one number for all owners, or one for each."""
    if has_wrong_count(numbers, owners):
        raise InputError(f"{len(numbers)} numbers of {name} for {len(owners)}: {', '.join(owners)}")


def broadcast_limits(bounds: Any, count: int) -> Array:
    """Return limits (count,) from one for all, one for each, or None for infinity.

    An array has the numbers of many runs, (runs,) or (count, runs); then the result is (count,
    runs).
    """
    runs = bounds.shape[-1:] if isinstance(bounds, np.ndarray) else ()
    values = np.asarray(np.inf if bounds is None else bounds, dtype=float)
    return make_read_only(np.broadcast_to(values, (count, *runs)).copy())


def check_deferred_numbers(later: Sequence[tuple[PerJoint, Any, Context]], axes: Axes) -> None:
    """Read numbers for each joint once the joints of the task are known; report a wrong count."""
    for spec, raw, c in later:
        with c.problems.at(*c.path):
            spec.read_each(raw, c.with_facts(commanded=lambda: axes))
