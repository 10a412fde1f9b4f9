"""The axes of a study: varied names with their values or samplers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, prefix_errors
from robsim.run.beliefs import find_common_belief, list_beliefs
from robsim.run.experiment import Experiment
from robsim.run.experiment_paths import find_path, get_number_at, get_unit_at
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.samplers import Choice, Product, Sampler, Sum
from robsim.studies.value_grid import assign_labels, parse_value_list

SHORTEST_FOCAL = 10.0  # pixels; shorter focal lengths in a study are probably factors


@dataclass(frozen=True, eq=False)
class StudyAxis:
    """A varied name with its enumerated values, its random choice of values, or its sampler."""

    name: str
    values: dict[str, Any] | None
    sampler: Any = None
    shape: tuple[int, ...] = ()
    nominal: Array | None = None  # value of the experiment, for `Sum` and `Product`
    factor: bool = False
    unit: str = ""
    has_labels: bool = False  # whether the labels were given
    checked_range: tuple[Array, Array] | None = None  # range of checked numbers

    @property
    def in_turn(self) -> bool:
        """Whether every draw is combined with each of the values."""
        return self.values is not None and self.sampler is None

    @property
    def is_number(self) -> bool:
        """Whether all values are numbers without labels of their own."""
        if self.values is None:
            return True
        return not self.has_labels and all(map(_is_real_number, self.values.values()))

    @property
    def labels(self) -> list[str]:
        """The labels of the values."""
        return list(self.values or ())

    def numbers(self, draws: RandomNumbers) -> Array:
        """Return sampled numbers (draws, *shape) in SI units."""
        sampled: Array = self.sampler.sample_values(draws, self.shape)
        if self.nominal is None:
            return sampled
        return np.asarray(self.nominal * sampled if self.factor else self.nominal + sampled)

    def check(self, experiment: Experiment, numbers: Array) -> StudyAxis:
        """Check the smallest and the largest of some numbers, and store them in the returned axis.

        Raises InputError or FileError with the invalid number.
        """
        extremes = numbers.min(axis=0), numbers.max(axis=0)
        checked = self.checked_range
        if checked and (extremes[0] >= checked[0]).all() and (extremes[1] <= checked[1]).all():
            return self
        for end in extremes:
            with prefix_errors(f"vary: {self.name}: sampled value {format_value(end.tolist())}"):
                experiment.at(self.name, end)
        return replace(self, checked_range=extremes)


def make_axis(experiment: Experiment, name: Any, value: Any) -> StudyAxis:
    """Return the axis of a name; raise InputError or FileError if it cannot be varied this way."""
    if not isinstance(name, str) or not name:
        raise InputError(
            f"vary: expected dotted names such as 'task.gain', got {format_value(name)}"
        )
    unit = get_unit_at(experiment, name)
    subject = f"vary: {name}"
    sampler = value if isinstance(value, Choice) else None
    values = (
        assign_labels(tuple(value.values), subject) if sampler else parse_value_list(value, subject)
    )
    if values is not None:
        return _make_value_axis(experiment, StudyAxis(name, None, sampler, unit=unit), *values)
    if not isinstance(value, Sampler) or isinstance(value, type):
        raise InputError(
            f"{subject}: expected a sampler such as rs.samplers.Uniform(low, high), or a list of "
            f"values, got {format_value(value)}"
        )
    try:
        return _make_number_axis(experiment, StudyAxis(name, None, value, unit=unit))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{subject}: {format_value(value)} does not have the shape of the varied number"
        ) from None


def _make_value_axis(
    experiment: Experiment, axis: StudyAxis, values: dict[str, Any], has_labels: bool
) -> StudyAxis:
    """Return an axis of values that are all valid; numbers are converted to SI units."""
    if all(map(_is_real_number, values.values())):
        _check_focal_lengths(experiment, axis.name, list(values.values()))
    for value in values.values():
        _check_own_belief(experiment, axis.name, value, experiment.at(axis.name, value))
    if axis.unit and all(isinstance(x, str) for x in values.values()):
        numbers = [get_number_at(experiment.at(axis.name, x), axis.name) for x in values.values()]
        if all(x.ndim == 0 for x in numbers):
            values = dict(zip(values, map(float, numbers), strict=True))
    return replace(axis, values=values, has_labels=has_labels)


def _check_own_belief(
    experiment: Experiment, name: str, value: Any, varied_experiment: Experiment
) -> None:
    """Raise InputError if a task has a belief that differs from the belief of the experiment."""
    if name != "task" or isinstance(value, str | dict):
        return
    beliefs_of_task = [belief for belief in list_beliefs(value) if belief is not None]
    if beliefs_of_task and any(
        belief != find_common_belief(experiment.task) for belief in beliefs_of_task
    ):
        raise InputError(
            f"vary: task: {format_value(value)} has a belief of its own; give it to the "
            "experiment, or vary it by its names, as in 'belief.cameras.eye.focal'"
        )


def _make_number_axis(experiment: Experiment, axis: StudyAxis) -> StudyAxis:
    """Return an axis of sampled numbers, in the shape of the varied number."""
    shape, factor = tuple(axis.sampler.shape), isinstance(axis.sampler, Product)
    if find_path(experiment, axis.name) is None:
        with prefix_errors("vary"):
            experiment.at(axis.name, None)  # an unknown name is an error before any sample
    if axis.name.endswith(".focal") and not isinstance(axis.sampler, Sum | Product):
        draws = RandomNumbers(0, "focal", np.arange(64))
        _check_focal_lengths(experiment, axis.name, axis.sampler.sample_values(draws, shape))
    if factor or isinstance(axis.sampler, Sum):
        nominal = get_number_at(experiment, axis.name)
        shape = np.broadcast_shapes(shape, nominal.shape)
        return replace(axis, shape=shape, nominal=nominal, factor=factor)
    return replace(axis, shape=shape or _shape_of_number(experiment, axis.name))


def _is_real_number(value: Any) -> bool:
    """Return whether a value is a number, but not a truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _check_focal_lengths(experiment: Experiment, name: str, values: ArrayLike) -> None:
    """Raise InputError for focal lengths of a few pixels, which are probably factors."""
    if not name.endswith(".focal") or np.abs(values).max() >= SHORTEST_FOCAL:
        return
    factor, nominal = np.ravel(values)[0], get_number_at(experiment, name).ravel()[0]
    raise InputError(
        f"vary: {name}: {factor:.4g} looks like a factor, and focal lengths are in pixels: "
        f"{nominal * factor:.4g}; random factors are rs.samplers.Product(...), "
        '{ kind = "times", of = ... } in a file'
    )


def _shape_of_number(experiment: Experiment, name: str) -> tuple[int, ...]:
    """Return the shape of the number at a name; () if there is none yet."""
    try:
        return get_number_at(experiment, name).shape
    except InputError:
        return ()
