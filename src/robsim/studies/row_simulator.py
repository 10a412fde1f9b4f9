"""Simulation of some runs of a plan, and the columns of their results."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import RankWarning, prefix_errors
from robsim.engine.loop import Loop
from robsim.engine.workers import advance_loop
from robsim.run.batch_numbers import BatchTemplate, is_batchable
from robsim.run.experiment import Experiment
from robsim.starts.rejection_sampler import draw_starts
from robsim.starts.rejections import describe_rejections
from robsim.starts.start_kinematics import StartKinematics
from robsim.studies.result_columns import (
    Columns,
    choose_block_size,
    collect_facts,
    collect_measures,
    collect_trajectories,
)
from robsim.studies.study_axes import StudyAxis
from robsim.studies.study_plan import START_NAME, Codes, Plan

T = TypeVar("T")
CACHE_SIZE = 100  # most cached variants


class StopRequest(Exception):
    """The user stopped a simulation; its runs have no results."""


class ChunkResult(NamedTuple):
    """Results of some runs: a column for each quantity, and the stored instants."""

    facts: Columns
    tracks: Columns


class ExperimentPart(NamedTuple):
    """Runs of one experiment, with their positions among the requested runs."""

    at: Codes
    experiment: Experiment


@dataclass(eq=False)
class RowSimulator:
    """Simulator of any range of runs of a plan."""

    plan: Plan
    threads: int | None = None
    chunk: int = 256
    _variants: dict[Any, Experiment] = field(default_factory=dict)
    _templates: dict[Any, tuple[BatchTemplate, Experiment]] = field(default_factory=dict)

    def simulate(self, first: int, last: int) -> ChunkResult:
        """Simulate the runs from `first` to `last` (exclusive), and return their results.

        Raises StopRequest after a stop.
        """
        runs = np.arange(first, last)
        draws = np.unique(runs // self.plan.cells)
        q0, tries, fits = self.starts(draws)
        place = runs // self.plan.cells - draws[0]
        result = ChunkResult({}, {})
        for part in self.parts(runs):
            part_draws = runs[part.at] // self.plan.cells
            for at, part_result in self._simulate_parts(
                part.experiment, part_draws, q0[place[part.at]]
            ):
                _store_values(result.facts, part_result.facts, part.at[at], len(runs))
                _store_values(result.tracks, part_result.tracks, part.at[at], len(runs))
        if self.plan.start is not None:
            result.facts["start_tries"] = tries[place]
            result.facts["began"] &= fits[place]
        return result

    def parts(self, runs: Codes) -> Iterator[ExperimentPart]:
        """Yield experiments that together contain the runs, with the positions of their runs."""
        value_axes = [axis for axis in self.plan.axes if not axis.is_number]
        codes = {axis.name: self.plan.codes(axis, runs) for axis in value_axes}
        for at in _group_equal_rows(codes.values(), len(runs)):
            own = {
                a.name: list((a.values or {}).values())[codes[a.name][at[0]]] for a in value_axes
            }
            yield from self._with_numbers(self._variant(own), runs, at)

    def _with_numbers(
        self, variant: Experiment, runs: Codes, at: Codes
    ) -> Iterator[ExperimentPart]:
        """Yield the variant with the numbers of the runs.

        One experiment varies its numbers from run to run if it can. Each value of the other numbers
        has a separate experiment.
        """
        numbers = {a.name: self._numbers(a, runs[at]) for a in self.plan.axes if a.is_number}
        per_run = {name: x for name, x in numbers.items() if is_batchable(variant, name, x)}
        per_experiment = {name: x for name, x in numbers.items() if name not in per_run}
        for group in _group_equal_rows(per_experiment.values(), len(at)):
            one = _apply_values(
                variant,
                {name: _to_number_or_array(x[group[0]]) for name, x in per_experiment.items()},
            )
            varied = {name: make_read_only(x[group]) for name, x in per_run.items()}
            yield ExperimentPart(at[group], one.with_(varied=varied) if varied else one)

    def _numbers(self, axis: StudyAxis, runs: Codes) -> Array:
        """Return the numbers of an axis; raise InputError for invalid numbers."""
        numbers = self.plan.numbers(axis, runs)
        if axis.values is None:
            axis.check(self.plan.experiment, numbers)
        return numbers

    def _variant(self, values: dict[str, Any]) -> Experiment:
        """Return the experiment with other values under some names."""
        key = tuple((name, id(value)) for name, value in values.items())
        return _get_cached(self._variants, key, lambda: _apply_values(self.plan.experiment, values))

    def starts(self, draws: Codes) -> tuple[Array, Codes, NDArray[np.bool_]]:
        """Return the starts (draws, nq) of some draws, their attempts, and their acceptance.

        If no attempt is accepted, the start is the last attempt.
        """
        experiment, start = self.plan.experiment, self.plan.start
        tries = np.ones(len(draws), dtype=np.int64)
        if self.plan.q0 is not None:
            return np.ascontiguousarray(self.plan.q0[draws]), tries, tries > 0
        if start is None:
            own = experiment.scene.home if experiment.start is None else experiment.start
            return np.tile(own, (len(draws), 1)), tries, tries > 0
        source = partial(self.plan.source, START_NAME)
        return draw_starts(start, self.reach, source, draws, self.begin if start.visible else None)

    def describe_rejections(self) -> str:
        """Return the reasons why no start of the plan is accepted, and advice."""
        assert self.plan.start is not None
        source, count = partial(self.plan.source, START_NAME), self.plan.draws

        def judge(draws: Codes, q0: Array) -> NDArray[np.bool_]:  # samples may outnumber the draws
            return self.begin(draws % count, q0)

        return describe_rejections(self.plan.start, self.reach, source, judge)

    @cached_property
    def reach(self) -> StartKinematics:
        """The moving frame, the goal and the target of the plan's experiment."""
        with _IgnoreRankWarnings():
            return StartKinematics(self.plan.experiment.loop().controller)

    def begin(self, draws: Codes, q0: Array) -> NDArray[np.bool_]:
        """Return whether starts (draws, nq) see their target and are within the limits.

        A start is checked in the scenes of its draw, for every enumerated value of the true scene.
        """
        accepted = np.ones(len(draws), dtype=bool)
        for cell in self.plan.true_scene_cells:
            for part in self.parts(draws * self.plan.cells + cell):
                one = part.experiment.with_(start=q0[part.at], duration=part.experiment.dt)
                accepted[part.at] &= collect_facts(self._run_all(one, draws[part.at]))["began"]
        return accepted

    def _simulate_parts(
        self, experiment: Experiment, draws: Codes, q0: Array
    ) -> Iterator[tuple[slice, ChunkResult]]:
        """Yield the results of the runs of an experiment, some runs at a time."""
        plan = self.plan
        size = choose_block_size(experiment) if plan.measures else len(draws)
        every = 1 if plan.measures else plan.trajectories
        for i in range(0, len(draws), size):
            some = slice(i, i + size)
            varied = {name: make_read_only(x[some]) for name, x in experiment.varied.items()}
            one = experiment.with_(start=q0[some], record=every or "summary", varied=varied)
            with prefix_errors(f"run of draw {draws[i]}"):
                loop = self._run_all(one, draws[some])
            yield (
                some,
                ChunkResult(
                    {
                        **collect_facts(loop),
                        **(collect_measures(one, loop) if plan.measures else {}),
                    },
                    collect_trajectories(loop, plan.trajectories) if plan.trajectories else {},
                ),
            )

    def _run_all(self, experiment: Experiment, numbers: Codes) -> Loop:
        """Return the loop of an experiment after all its runs, with the given run numbers."""
        with _IgnoreRankWarnings():
            loop = experiment.loop(numbers, self._template(experiment))
            if not advance_loop(loop, self.threads, self.chunk, None):
                raise StopRequest
        return loop

    def _template(self, experiment: Experiment) -> BatchTemplate | None:
        """Return the parts that all experiments of a variant share, from the cache."""
        if not experiment.varied:
            return None
        parts = experiment.sensing, experiment.actuation
        key = id(experiment.task), id(experiment.scene), *parts, *experiment.varied
        return _get_cached(self._templates, key, lambda: (BatchTemplate(experiment), experiment))[0]


def _get_cached(cache: dict[Any, T], key: Any, make: Callable[[], T]) -> T:
    """Return the cached value of a key; `make` computes it on first use."""
    if key not in cache:
        if len(cache) >= CACHE_SIZE:
            cache.clear()
        cache[key] = make()
    return cache[key]


def _apply_values(base: Experiment, values: dict[str, Any]) -> Experiment:
    """Return an experiment with other values under some names; outer names are set first."""
    ordered = sorted(values.items(), key=lambda each: each[0].count("."))
    return base.at(dict(ordered)) if values else base


def _group_equal_rows(columns: Iterable[Any], count: int) -> Iterator[Codes]:
    """Yield the indices of equal rows of several columns (count, ...), group by group."""
    table = [np.zeros((count, 1)), *(np.reshape(x, (count, -1)) for x in columns)]
    _, group = np.unique(np.concatenate(table, axis=1), axis=0, return_inverse=True)
    for number in range(group.max() + 1):
        yield np.flatnonzero(group.reshape(-1) == number)


def _store_values(columns: Columns, values_by_name: Columns, at: Codes, count: int) -> None:
    """Store the values of some runs at their positions; missing values of other runs are NaN."""
    for name, values in values_by_name.items():
        if name not in columns:
            fill = np.nan if values.dtype.kind == "f" else 0
            columns[name] = np.full((count, *values.shape[1:]), fill, dtype=values.dtype)
        columns[name][at] = values


def _to_number_or_array(value: Any) -> Any:
    """Return a scalar as a float, and others as an array."""
    return float(value) if np.ndim(value) == 0 else np.array(value)


class _IgnoreRankWarnings(warnings.catch_warnings):
    """Context that ignores rank warnings; the check of the plan gives them."""

    def __enter__(self) -> None:
        super().__enter__()
        warnings.simplefilter("ignore", RankWarning)
