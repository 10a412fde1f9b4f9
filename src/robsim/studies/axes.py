"""The axes of a study: what differs from run to run under one dotted name, and how."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, naming, said
from robsim.declare.lookup import unit_at
from robsim.run.experiment import Experiment
from robsim.run.present import number_at
from robsim.run.text import ExperimentTable
from robsim.studies.draws import Draws
from robsim.studies.in_turn import labelled, values_in_turn
from robsim.studies.samplers import Choice, Plus, Sampler, Times

SCALE = 10.0  # pixels, below which a focal length is a factor, as in `Scene.believe`


@dataclass(frozen=True, eq=False)
class Axis:
    """A varied name: values by label, in turn or by chance, or what draws numbers."""

    name: str
    values: dict[str, Any] | None
    sampler: Any = None
    shape: tuple[int, ...] = ()
    nominal: Array | None = None  # the value of the experiment, which Plus and Times change
    factor: bool = False
    unit: str = ""
    ends: tuple[Array, Array] | None = None  # least and largest numbers that are known to be valid

    @property
    def in_turn(self) -> bool:
        """Whether every draw is run with each of its values."""
        return self.values is not None and self.sampler is None

    @property
    def is_number(self) -> bool:
        """Whether all its values are numbers."""
        if self.values is None:
            return True
        return all(
            isinstance(x, int | float) and not isinstance(x, bool) for x in self.values.values()
        )

    @property
    def labels(self) -> list[str]:
        """The labels of its values."""
        return list(self.values or ())

    def numbers(self, draws: Draws) -> Array:
        """Return what is drawn (draws, *shape), in SI."""
        drawn: Array = self.sampler.drawn(draws, self.shape)
        if self.nominal is None:
            return drawn
        return np.asarray(self.nominal * drawn if self.factor else self.nominal + drawn)

    def check(self, experiment: Experiment, numbers: Array) -> Axis:
        """Return the axis, once the least and the largest of some numbers are valid in SI.

        InputError or FileError: one is not, and which.
        """
        found = numbers.min(axis=0), numbers.max(axis=0)
        known = self.ends
        if known and (found[0] >= known[0]).all() and (found[1] <= known[1]).all():
            return self
        for end in found:
            with naming(f"vary: {self.name}: {said(end.tolist())} was drawn"):
                experiment.at(self.name, end)
        return replace(self, ends=found)

    def picked(self, draws: Draws) -> NDArray[np.int64]:
        """Return the numbers (draws,) of the values that are drawn."""
        found: NDArray[np.int64] = self.sampler.picked(draws)
        return found


def axis_of(experiment: Experiment, name: Any, given: Any) -> Axis:
    """Return the axis of a name; InputError or FileError for what cannot be varied so."""
    if not isinstance(name, str) or not name:
        raise InputError(f"vary: expected dotted names such as 'task.gain', got {said(name)}")
    made = _axis(experiment, name, given)
    plain = name.removeprefix("belief.")
    return replace(made, unit=unit_at(ExperimentTable, experiment.tables, plain))


def _axis(experiment: Experiment, name: str, given: Any) -> Axis:
    values = values_in_turn(given, f"vary: {name}")
    if values is not None:
        return _checked(experiment, Axis(name, values))
    if isinstance(given, Choice):
        return _checked(experiment, Axis(name, labelled(given.values), given))
    if not isinstance(given, Sampler) or isinstance(given, type):
        raise InputError(
            f"vary: {name}: expected a sampler such as rs.Uniform(low, high), or a list of values, "
            f"got {said(given)}"
        )
    return _of_numbers(experiment, name, given)


def _checked(experiment: Experiment, axis: Axis) -> Axis:
    """Return an axis whose values are all valid under its name."""
    for value in (axis.values or {}).values():
        experiment.at(axis.name, value)
    return axis


def _of_numbers(experiment: Experiment, name: str, sampler: Any) -> Axis:
    shape = tuple(sampler.shape)
    if isinstance(sampler, Plus | Times):
        nominal = number_at(experiment, name)
        factor = isinstance(sampler, Times)
        return Axis(name, None, sampler, np.broadcast_shapes(shape, nominal.shape), nominal, factor)
    if name.endswith(".focal") and _are_factors(sampler):
        nominal = number_at(experiment, name)
        return Axis(name, None, sampler, np.broadcast_shapes(shape, nominal.shape), nominal, True)
    if not shape:
        shape = _shape_at(experiment, name)
    return Axis(name, None, sampler, shape)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _are_factors(sampler: Any) -> bool:
    """Return whether what is drawn for a focal length is too small to be pixels."""
    probe = Draws(0, "focal", np.arange(64))
    return bool(np.abs(sampler.drawn(probe, tuple(sampler.shape))).max() < SCALE)


def _shape_at(experiment: Experiment, name: str) -> tuple[int, ...]:
    """Return the shape of the number at a name; () where there is none yet."""
    try:
        return number_at(experiment, name).shape
    except InputError:
        return ()
