"""The simulation of some runs of a plan, and the columns of what came out."""

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
from robsim.starts.start_kinematics import StartKinematics
from robsim.studies.result_columns import (
    Columns,
    choose_block_size,
    collect_facts,
    collect_measures,
    collect_trajectories,
)
from robsim.studies.study_axes import StudyAxis
from robsim.studies.study_plan import Codes, Plan

T = TypeVar("T")
CACHE_SIZE = 100  # variants whose templates are kept


class StopRequest(Exception):
    """A stop came while runs were simulated; they count as not begun."""


class ChunkResult(NamedTuple):
    """What came out of some runs: a column of each fact, and what was kept of each instant."""

    facts: Columns
    tracks: Columns


class ExperimentPart(NamedTuple):
    """Some of the runs that one experiment makes: their places, and the experiment."""

    at: Codes
    experiment: Experiment


@dataclass(eq=False)
class RowSimulator:
    """What simulates the runs of a plan, from any one to any other."""

    plan: Plan
    threads: int | None = None
    chunk: int = 256
    _variants: dict[Any, Experiment] = field(default_factory=dict)
    _templates: dict[Any, tuple[BatchTemplate, Experiment]] = field(default_factory=dict)

    def done(self, first: int, last: int) -> ChunkResult:
        """Simulate the runs from one until before another, and return what came out of them.

        Stopped: a stop came before they had all ended.
        """
        runs = np.arange(first, last)
        draws = np.unique(runs // self.plan.cells)
        q0, tries, fits = self.starts(draws)
        place = runs // self.plan.cells - draws[0]
        made = ChunkResult({}, {})
        for part in self.parts(runs):
            some = runs[part.at] // self.plan.cells
            for at, found in self._simulated(part.experiment, some, q0[place[part.at]]):
                _store_values(made.facts, found.facts, part.at[at], len(runs))
                _store_values(made.tracks, found.tracks, part.at[at], len(runs))
        if self.plan.start is not None:
            made.facts["start_tries"] = tries[place]
            made.facts["began"] &= fits[place]
        return made

    def parts(self, runs: Codes) -> Iterator[ExperimentPart]:
        """Yield experiments which together have these runs, with the places of their runs."""
        plain = [axis for axis in self.plan.axes if not axis.is_number]
        codes = {axis.name: self.plan.codes(axis, runs) for axis in plain}
        for at in _group_equal_rows(codes.values(), len(runs)):
            own = {a.name: list((a.values or {}).values())[codes[a.name][at[0]]] for a in plain}
            yield from self._with_numbers(self._variant(own), runs, at)

    def _with_numbers(
        self, variant: Experiment, runs: Codes, at: Codes
    ) -> Iterator[ExperimentPart]:
        """Yield the variant with numbers of its own in each run, or one for each number."""
        numbers = {a.name: self._numbers(a, runs[at]) for a in self.plan.axes if a.is_number}
        bulk = {name: x for name, x in numbers.items() if is_batchable(variant, name, x)}
        single = {name: x for name, x in numbers.items() if name not in bulk}
        for some in _group_equal_rows(single.values(), len(at)):
            one = _apply_values(
                variant, {name: _to_number_or_array(x[some[0]]) for name, x in single.items()}
            )
            varied = {name: make_read_only(x[some]) for name, x in bulk.items()}
            yield ExperimentPart(at[some], one.with_(varied=varied) if varied else one)

    def _numbers(self, axis: StudyAxis, runs: Codes) -> Array:
        """Return the numbers of an axis; InputError for any that is not valid."""
        found = self.plan.numbers(axis, runs)
        if axis.values is None:
            axis.check(self.plan.experiment, found)
        return found

    def _variant(self, values: dict[str, Any]) -> Experiment:
        """Return the experiment with other objects under some names."""
        key = tuple((name, id(value)) for name, value in values.items())
        return _get_cached(self._variants, key, lambda: _apply_values(self.plan.experiment, values))

    def starts(self, draws: Codes) -> tuple[Array, Codes, NDArray[np.bool_]]:
        """Return the starts (draws, nq) of some draws, how many were drawn, and which will do.

        Those that will not do are the last that were drawn.
        """
        experiment, start = self.plan.experiment, self.plan.start
        tries = np.ones(len(draws), dtype=np.int64)
        if self.plan.q0 is not None:
            return np.ascontiguousarray(self.plan.q0[draws]), tries, tries > 0
        if start is None:
            own = experiment.scene.home if experiment.start is None else experiment.start
            return np.tile(own, (len(draws), 1)), tries, tries > 0
        source = partial(self.plan.source, "start")
        return draw_starts(start, self.reach, source, draws, self.begin if start.visible else None)

    @cached_property
    def reach(self) -> StartKinematics:
        """The places of the plan's experiment."""
        with _IgnoreRankWarnings():
            return StartKinematics(self.plan.experiment.loop().controller)

    def begin(self, draws: Codes, q0: Array) -> NDArray[np.bool_]:
        """Return which starts (draws, nq) see their target and are within the limits.

        It is judged with the numbers of the draw, in every true scene that is in turn.
        """
        found = np.ones(len(draws), dtype=bool)
        for cell in self.plan.seen:
            for part in self.parts(draws * self.plan.cells + cell):
                one = part.experiment.with_(start=q0[part.at], duration=part.experiment.dt)
                found[part.at] &= collect_facts(self._ended(one, draws[part.at]))["began"]
        return found

    def _simulated(
        self, experiment: Experiment, draws: Codes, q0: Array
    ) -> Iterator[tuple[slice, ChunkResult]]:
        """Yield what came out of the runs of an experiment, some of them at a time."""
        plan = self.plan
        size = choose_block_size(experiment) if plan.measures else len(draws)
        every = 1 if plan.measures else plan.trajectories
        for i in range(0, len(draws), size):
            some = slice(i, i + size)
            varied = {name: make_read_only(x[some]) for name, x in experiment.varied.items()}
            one = experiment.with_(start=q0[some], record=every or "summary", varied=varied)
            with prefix_errors(f"run of draw {draws[i]}"):
                loop = self._ended(one, draws[some])
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

    def _ended(self, experiment: Experiment, numbers: Codes) -> Loop:
        """Return the loop of an experiment after all its runs, with these numbers."""
        with _IgnoreRankWarnings():
            loop = experiment.loop(numbers, self._template(experiment))
            if not advance_loop(loop, self.threads, self.chunk, None):
                raise StopRequest
        return loop

    def _template(self, experiment: Experiment) -> BatchTemplate | None:
        """Return what is the same for all parts of the same variant, made once."""
        if not experiment.varied:
            return None
        parts = experiment.sensing, experiment.actuation
        key = id(experiment.task), id(experiment.scene), *parts, *experiment.varied
        return _get_cached(self._templates, key, lambda: (BatchTemplate(experiment), experiment))[0]


def _get_cached(known: dict[Any, T], key: Any, make: Callable[[], T]) -> T:
    """Return what is known by a key, which is made when it is first asked for."""
    if key not in known:
        if len(known) >= CACHE_SIZE:
            known.clear()
        known[key] = make()
    return known[key]


def _apply_values(base: Experiment, values: dict[str, Any]) -> Experiment:
    """Return an experiment with other values under some names, a whole before its parts."""
    ordered = sorted(values.items(), key=lambda each: each[0].count("."))
    return base.at(dict(ordered)) if values else base


def _group_equal_rows(columns: Iterable[Any], count: int) -> Iterator[Codes]:
    """Yield the rows in which all of some columns (count, ...) are the same, group by group."""
    table = [np.zeros((count, 1)), *(np.reshape(x, (count, -1)) for x in columns)]
    _, group = np.unique(np.concatenate(table, axis=1), axis=0, return_inverse=True)
    for number in range(group.max() + 1):
        yield np.flatnonzero(group.reshape(-1) == number)


def _store_values(into: Columns, found: Columns, at: Codes, count: int) -> None:
    """Put the values of some runs in their places; where others have none there is NaN."""
    for name, values in found.items():
        if name not in into:
            fill = np.nan if values.dtype.kind == "f" else 0
            into[name] = np.full((count, *values.shape[1:]), fill, dtype=values.dtype)
        into[name][at] = values


def _to_number_or_array(value: Any) -> Any:
    """Return a number, or an array of several."""
    return float(value) if np.ndim(value) == 0 else np.array(value)


class _IgnoreRankWarnings(warnings.catch_warnings):
    """A block without warnings that were given when the study was planned."""

    def __enter__(self) -> None:
        super().__enter__()
        warnings.simplefilter("ignore", RankWarning)
