"""The axes of a study: what differs from run to run under one dotted name, and how."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, prefix_errors
from robsim.run.beliefs import find_common_belief, list_beliefs
from robsim.run.experiment import Experiment
from robsim.run.experiment_paths import get_number_at, get_unit_at
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.samplers import Choice, Product, Sampler, Sum
from robsim.studies.value_grid import assign_labels, parse_value_list

FOCAL_FACTOR = 10.0  # pixels, below which a focal length is a factor, as in `Scene.believe`


@dataclass(frozen=True, eq=False)
class StudyAxis:
    """A varied name: values by label, in turn or by chance, or what draws numbers."""

    name: str
    values: dict[str, Any] | None
    sampler: Any = None
    shape: tuple[int, ...] = ()
    nominal: Array | None = None  # the value of the experiment, which Plus and Times change
    factor: bool = False
    unit: str = ""
    named: bool = False  # whether the labels of its values were given
    ends: tuple[Array, Array] | None = None  # least and largest numbers that are known to be valid

    @property
    def in_turn(self) -> bool:
        """Whether every draw is run with each of its values."""
        return self.values is not None and self.sampler is None

    @property
    def is_number(self) -> bool:
        """Whether all its values are numbers, and go by no other names."""
        if self.values is None:
            return True
        return not self.named and all(map(_is_real_number, self.values.values()))

    @property
    def labels(self) -> list[str]:
        """The labels of its values."""
        return list(self.values or ())

    def numbers(self, draws: RandomNumbers) -> Array:
        """Return what is drawn (draws, *shape), in SI."""
        drawn: Array = self.sampler.drawn(draws, self.shape)
        if self.nominal is None:
            return drawn
        return np.asarray(self.nominal * drawn if self.factor else self.nominal + drawn)

    def check(self, experiment: Experiment, numbers: Array) -> StudyAxis:
        """Return the axis, once the least and the largest of some numbers are valid in SI.

        InputError or FileError: one is not, and which.
        """
        found = numbers.min(axis=0), numbers.max(axis=0)
        known = self.ends
        if known and (found[0] >= known[0]).all() and (found[1] <= known[1]).all():
            return self
        for end in found:
            with prefix_errors(f"vary: {self.name}: {format_value(end.tolist())} was drawn"):
                experiment.at(self.name, end)
        return replace(self, ends=found)


def make_axis(experiment: Experiment, name: Any, given: Any) -> StudyAxis:
    """Return the axis of a name; InputError or FileError for what cannot be varied so."""
    if not isinstance(name, str) or not name:
        raise InputError(
            f"vary: expected dotted names such as 'task.gain', got {format_value(name)}"
        )
    unit = get_unit_at(experiment, name)
    what = f"vary: {name}"
    sampler = given if isinstance(given, Choice) else None
    labelled = assign_labels(given.values, what) if sampler else parse_value_list(given, what)
    if labelled is not None:
        return _make_value_axis(experiment, StudyAxis(name, None, sampler, unit=unit), *labelled)
    if not isinstance(given, Sampler) or isinstance(given, type):
        raise InputError(
            f"{what}: expected a sampler such as rs.Uniform(low, high), or a list of values, "
            f"got {format_value(given)}"
        )
    try:
        return _make_number_axis(experiment, StudyAxis(name, None, given, unit=unit))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{what}: {format_value(given)} has not the shape of what is there"
        ) from None


def _make_value_axis(
    experiment: Experiment, axis: StudyAxis, values: dict[str, Any], named: bool
) -> StudyAxis:
    """Return an axis of values that are all valid under its name; in SI where they are numbers."""
    numeric = axis.name.endswith(".focal") and all(map(_is_real_number, values.values()))
    if numeric and max(map(abs, values.values())) < FOCAL_FACTOR:
        nominal = get_number_at(experiment, axis.name)
        values = {label: (x * nominal).tolist() for label, x in values.items()}
    for value in values.values():
        _check_own_belief(experiment, axis.name, value, experiment.at(axis.name, value))
    if axis.unit and all(isinstance(x, str) for x in values.values()):
        numbers = [get_number_at(experiment.at(axis.name, x), axis.name) for x in values.values()]
        if all(x.ndim == 0 for x in numbers):
            values = dict(zip(values, map(float, numbers), strict=True))
    return replace(axis, values=values, named=named)


def _check_own_belief(experiment: Experiment, name: str, value: Any, made: Experiment) -> None:
    """Raise InputError for a task with a belief of its own, which is not that of the experiment."""
    if name != "task" or isinstance(value, str | dict):
        return
    own = [belief for belief in list_beliefs(value) if belief is not None]
    if own and any(belief != find_common_belief(experiment.task) for belief in own):
        raise InputError(
            f"vary: task: {format_value(value)} has a belief of its own; give it to the experiment, or "
            "vary it by its names, as in 'belief.cameras.eye.focal'"
        )


def _make_number_axis(experiment: Experiment, axis: StudyAxis) -> StudyAxis:
    """Return an axis of numbers that are drawn, in the shape of what is there."""
    shape, factor = tuple(axis.sampler.shape), isinstance(axis.sampler, Product)
    if axis.name.endswith(".focal") and not isinstance(axis.sampler, Sum | Product):
        factor = _draws_factors(axis.sampler)
    if factor or isinstance(axis.sampler, Sum):
        nominal = get_number_at(experiment, axis.name)
        shape = np.broadcast_shapes(shape, nominal.shape)
        return replace(axis, shape=shape, nominal=nominal, factor=factor)
    return replace(axis, shape=shape or _shape_of_number(experiment, axis.name))


def _is_real_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _draws_factors(sampler: Any) -> bool:
    """Return whether what is drawn for a focal length is too small to be pixels."""
    shape = tuple(sampler.shape)
    probe = RandomNumbers(0, "focal", np.arange(64), evenly=(max(math.prod(shape), 1), 0))
    return bool(np.abs(sampler.drawn(probe, shape)).max() < FOCAL_FACTOR)


def _shape_of_number(experiment: Experiment, name: str) -> tuple[int, ...]:
    """Return the shape of the number at a name; () where there is none yet."""
    try:
        return get_number_at(experiment, name).shape
    except InputError:
        return ()
