"""Numbers of joints: each in the unit of its joint, which the scene knows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robsim.base import units
from robsim.base.arrays import Array, frozen, numbers, one_or_each
from robsim.base.errors import InputError, UnitError, said
from robsim.declare.problems import Broken, under
from robsim.declare.quantities import DIMENSIONS, EXAMPLES, SI, coordinate, either, written
from robsim.declare.spec import Context, NoText, Raw, Spec, expected


class Axes(NamedTuple):
    """The units and names of the joints that numbers belong to."""

    units: Sequence[str]
    names: Sequence[str]


AxesOf = Callable[[Context], Axes | None]  # None where the scene is not known


def coordinates(c: Context) -> Axes | None:
    """Return the coordinates of the scene."""
    scene = c.facts.get("scene")
    return None if scene is None else Axes(scene.coordinate_units, scene.coordinate_names)


def velocities(c: Context) -> Axes | None:
    """Return the velocities of the scene."""
    scene = c.facts.get("scene")
    return None if scene is None else Axes(scene.velocity_units, scene.velocity_names)


def accelerations(c: Context) -> Axes | None:
    """Return the accelerations of the scene."""
    found = velocities(c)
    return found and Axes([f"{unit}^2" for unit in found.units], found.names)


def commanded(c: Context) -> Axes | None:
    """Return the velocities that the task around a value commands; None while it is read."""
    known = c.facts.get("commanded")
    try:
        return known() if known else None
    except InputError:
        return None  # of a task that this scene cannot have


def followed(c: Context) -> Axes | None:
    """Return the coordinates of the joints that the task around a value follows."""
    axes: Axes | None = c.facts.get("followed")
    return axes


def per(axes: AxesOf, suffix: str, cut: bool = False) -> AxesOf:
    """Return axes with another unit: "rad" as "rad/s", or, to `cut`, the other way round."""

    def changed(c: Context) -> Axes | None:
        found = axes(c)
        if found is None:
            return None
        each = [u.removesuffix(suffix) if cut else f"{u}{suffix}" for u in found.units]
        return Axes(each, found.names)

    return changed


@dataclass(frozen=True)
class PerJoint(Spec):
    """A list of one number for each joint, which becomes an array.

    `later` says that the joints are known only once the task around it is: until then each number
    is read by whichever of `dimensions` its unit is of, and `check_later` has the last word.
    """

    axes: AxesOf
    united: ClassVar[bool] = True
    noun: str = "coordinates"
    dimensions: tuple[units.Dimension, ...] = ("angle", "length")
    later: bool = False
    above: float | None = None
    form: ClassVar[str] = "list"

    def check(self, value: Any, what: str) -> Any:
        array = numbers(value, what, ("n",))
        if array.ndim != 1 or not array.size:
            raise InputError(
                f"{what}: expected one number for each joint, of shape (n,), got {array.shape}"
            )
        if self.above is not None and not (array > self.above).all():
            raise InputError(
                f"{what}: every number must be above {self.above:g}, got {said(value)}"
            )
        return frozen(array)

    def read(self, raw: Raw, c: Context) -> list[float]:
        if not isinstance(raw, list):
            raise expected("a list", raw)
        self._check_plain(raw, c)
        axes = self.axes(c)
        if axes is None:
            return self._read_without(raw, c)
        return self.read_for(axes, raw, c)

    def read_for(self, axes: Axes, raw: Sequence[Raw], c: Context) -> list[float]:
        """Return the numbers in the units of these joints."""
        if len(raw) != len(axes.units):
            names = ", ".join(axes.names) or "none"
            raise InputError(f"{len(raw)} {self.noun}, expected {len(axes.units)}: {names}")
        items = zip(raw, axes.units, strict=True)
        return self._each([partial(coordinate, text, unit) for text, unit in items], raw)

    def write(self, value: Any, c: Context) -> list[str]:
        axes = self.axes(c)
        if axes is None or len(value) != len(axes.units):
            count = "?" if axes is None else len(axes.units)
            raise NoText(f"{len(value)} numbers for {count} joints")
        return [written(x, unit) for x, unit in zip(value, axes.units, strict=True)]

    def words(self) -> str:
        examples = " or ".join(f'"{EXAMPLES[d]}"' for d in self.dimensions)
        return f"one number for each joint, as in {examples}"

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        axes = self.axes(place.c)
        if value is None or axes is None or np.shape(value) != (len(axes.units),):
            return ()
        limits = place.c.facts["scene"].limits if self.axes is coordinates else None
        return [place.several(value, tuple(axes.names), tuple(axes.units), limits=limits)]

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "array", "items": {"type": ["string", "number"]}}

    def _check_plain(self, raw: list[Raw], c: Context) -> None:
        """Raise Broken unless each value is a text or a number."""
        before = c.problems.seen
        for i, text in enumerate(raw):
            if isinstance(text, bool) or not isinstance(text, str | int | float):
                example = 'expected a text with a unit, as in "90 deg" or "5 cm"'
                c.at(i).report(f"{said(text)}: {example}")
        if c.problems.seen > before:
            raise Broken

    def _read_without(self, raw: list[Raw], c: Context) -> list[float]:
        if not self.later:
            raise Broken  # for the scene, or the robot, is wrong already
        c.facts["later"].append((self, raw, c))
        return self._each([partial(either, text, *self.dimensions) for text in raw], raw)

    def _each(self, reads: Sequence[Callable[[], float]], raw: Any) -> list[float]:
        made = []
        for i, read in enumerate(reads):
            with under(i):
                made.append(read())
                if self.above is not None and not made[-1] > self.above:
                    raise expected(f"greater than {self.above:g}", raw[i])
        return made


@dataclass(frozen=True)
class OneOrEach(PerJoint):
    """A number for all joints, or a list of one for each, which becomes a tuple."""

    zero: bool = False  # whether it may be zero
    forms: ClassVar[tuple[str, ...]] = ("plain", "list")

    def check(self, value: Any, what: str) -> Any:
        return one_or_each(value, what, "joint", zero=self.zero)

    def read(self, raw: Raw, c: Context) -> Any:
        if isinstance(raw, list):
            values = super().read(raw, c)
            for i, value in enumerate(values):
                with under(i):
                    self._checked(value, raw[i])
            return tuple(values)
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            raise UnitError(f"{said(raw)}: expected {self.words()}")
        kinds = self._kinds(c)
        if len(kinds) == 1:
            value = coordinate(raw, kinds[0])
        else:
            dimensions = [DIMENSIONS[kind] for kind in kinds] or self.dimensions
            value = either(raw, *dimensions)
        return self._checked(value, raw)

    def write(self, value: Any, c: Context) -> Any:
        if isinstance(value, tuple):
            return super().write(value, c)
        kinds = self._kinds(c) or [SI[self.dimensions[0]]]
        return written(value, kinds[0])  # of whatever joint: it is for all

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        kinds = self._kinds(place.c)
        if isinstance(value, float) and kinds:  # in the unit of the first: it is for all
            return [place.slider(value, kinds[0], 0.0, None, True)]
        return super().controls(value, place)

    def words(self) -> str:
        examples = " or ".join(f'"{EXAMPLES[d]}"' for d in self.dimensions)
        return f"one number with its unit for all, as in {examples}, or a list of one for each"

    def accepts(self) -> str:
        return "one number for all, or a list of one for each"

    def schema(self, define: Any) -> dict[str, Any]:
        for_all = [{"type": "string", "pattern": units.pattern(each)} for each in self.dimensions]
        return {"anyOf": [*for_all, super().schema(define)]}

    def _kinds(self, c: Context) -> list[str]:
        """Return the units that the joints have, each once, without "1"."""
        axes = self.axes(c)
        return [unit for unit in dict.fromkeys(axes.units if axes else ()) if unit != "1"]

    def _checked(self, value: float, raw: Raw) -> float:
        if value < 0 or (value == 0 and not self.zero):
            raise expected("not below 0" if self.zero else "greater than 0", raw)
        return value


@dataclass(frozen=True)
class OfJoint(Spec):
    """A number in the unit of the joint whose table is around it; `per` is "" or "/s"."""

    united: ClassVar[bool] = True
    per: str = ""
    above: float | None = None

    def check(self, value: Any, what: str) -> float:
        number = numbers(value, what, ())
        if number.ndim or (self.above is not None and not number > self.above):
            raise InputError(f"{what} must be {self.words()}, got {said(value)}")
        return float(number)

    def read(self, raw: Raw, c: Context) -> float:
        if isinstance(raw, bool) or not isinstance(raw, str | int | float):
            raise UnitError(f"{said(raw)}: expected {self.words()}")
        number = coordinate(raw, f"{unit_of(c)}{self.per}")
        if self.above is not None and not number > self.above:
            raise expected(f"greater than {self.above:g}", raw)
        return number

    def write(self, value: Any, c: Context) -> str:
        return written(value, f"{unit_of(c)}{self.per}")

    def words(self) -> str:
        positive = "positive number" if self.above == 0 else "number"
        return f"a {positive} in the unit of the joint{self.per}"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "string"}


def unit_of(c: Context) -> str:
    """Return the unit of the only coordinate of the joint; InputError if it has not one."""
    kind = c.facts["joint"]
    if kind is None:
        raise Broken
    if len(kind.units) != 1:
        raise InputError(f"a {kind.name} joint has none; joints of one coordinate have one")
    unit: str = kind.units[0]
    return unit


def misfits(given: Any, owners: Sequence[str]) -> bool:
    """Return whether there is a number for each, but not of these names; (n, runs) if runs differ.

    One number for all, or one for each run, is no misfit.
    """
    return (isinstance(given, tuple) or np.ndim(given) > 1) and len(given) != len(owners)


def check_count(given: Any, name: str, owners: Sequence[str]) -> None:
    """Raise InputError unless there is one number for all, or one for each of these names."""
    if misfits(given, owners):
        raise InputError(f"{len(given)} numbers of {name} for {len(owners)}: {', '.join(owners)}")


def limits_of(given: Any, count: int) -> Array:
    """Return limits (count,) from one for all, one for each, or None for infinity.

    An array has the numbers of many runs, (runs,) or (count, runs): then the limits have, too.
    """
    runs = given.shape[-1:] if isinstance(given, np.ndarray) else ()
    values = np.asarray(np.inf if given is None else given, dtype=float)
    return frozen(np.broadcast_to(values, (count, *runs)).copy())


def check_later(later: Sequence[tuple[PerJoint, Any, Context]], axes: Axes) -> None:
    """Report what does not fit the joints of a task, now that they are known."""
    for spec, raw, c in later:
        own = spec.axes(c.knowing(commanded=lambda: axes)) or axes
        try:
            spec.read_for(own, raw, c)
        except InputError as error:
            c.blame(error)
        except Broken:
            continue


def named_numbers(raw: Mapping[str, Raw], axes: Axes, c: Context) -> dict[str, float]:
    """Return {joint: number}, each in the unit of its joint."""
    made, before = {}, c.problems.seen
    for (name, text), unit in zip(raw.items(), axes.units, strict=True):
        try:
            made[name] = coordinate(text, unit)
        except InputError as error:
            c.at(name).blame(error)
    if c.problems.seen > before:
        raise Broken
    return made
