"""The plan of a study: the draws, the varied names and their values for each run."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations, takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_bool, as_integer
from robsim.base.errors import InputError, format_value
from robsim.run.experiment import Experiment
from robsim.run.experiment_paths import is_true_scene_name
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.run.run_checks import check_instance, check_starts
from robsim.starts.start_samplers import Anywhere, Start
from robsim.statistics.random_numbers import MOST_EVEN, RandomNumbers
from robsim.studies.samplers import Uniform, count_given_values, is_sobol
from robsim.studies.study_axes import StudyAxis, make_axis

MOST_RUNS = 10**12
CHECKED_DRAWS = 200_000  # draws with samples that are checked before the simulation
MOST_CELLS = 100_000  # combinations of enumerated values
Codes = NDArray[np.int64]
START_NAME = "start"  # name of the random numbers of starts


@dataclass(frozen=True, eq=False)
class Plan:
    """Runs of one experiment: draws, each combined with every combination of enumerated values.

    With `cells` combinations, run number r belongs to draw r // cells and has the combination
    r % cells. A sample depends on the seed, the name of its axis and the draw alone (a point of
    Sobol's sequence also on the number of Sobol axes). Runs of one draw therefore differ only in
    enumerated values, and any subset of the runs can be simulated anywhere.
    """

    experiment: Experiment
    draws: int
    seed: int
    axes: tuple[StudyAxis, ...] = ()
    start: Start | None = None
    q0: Array | None = None  # (draws, nq), given starts
    trajectories: int | None = None  # every n-th instant is stored, if any
    measures: bool = False  # whether the standard measures are computed

    @cached_property
    def in_turn(self) -> tuple[StudyAxis, ...]:
        """The axes with enumerated values."""
        return tuple(axis for axis in self.axes if axis.in_turn)

    @cached_property
    def cells(self) -> int:
        """The number of combinations of enumerated values."""
        return math.prod(len(axis.values or ()) for axis in self.in_turn)

    def cells_of(self, names: Iterable[str]) -> Codes:
        """Return the combinations of the named values, with the first value for all other names."""
        cells = np.arange(self.cells)
        for axis in self.in_turn:
            if axis.name not in names:
                cells = cells[self.codes(axis, cells) == 0]
        return cells

    @property
    def true_scene_cells(self) -> Codes:
        """The combinations with different true scenes; a start must be valid in each of them."""
        return self.cells_of([axis.name for axis in self.in_turn if is_true_scene_name(axis.name)])

    @property
    def runs(self) -> int:
        """The total number of runs."""
        return self.draws * self.cells

    def __str__(self) -> str:
        """Return the number of runs and the varied names, in one line."""
        turns = [f"{len(axis.values or ())} of {axis.name}" for axis in self.in_turn]
        sampled = [axis.name for axis in self.axes if not axis.in_turn]
        sampled = [*(["start"] if self.start else []), *sampled]
        counts = " x ".join([f"{self.draws} draws", *turns])
        return f"{self.runs} runs: {counts}" + (f"; drawn: {', '.join(sampled)}" if sampled else "")

    def source(self, name: str, draws: Codes, attempt: int = 0) -> RandomNumbers:
        """Return the random numbers of a name for some draws."""
        before = takewhile(lambda axis: axis.name != name, self.axes)
        dimension = sum(math.prod(axis.shape) for axis in before if is_sobol(axis.sampler))
        return RandomNumbers(self.seed, name, draws, attempt, dimension)

    def codes(self, axis: StudyAxis, runs: Codes) -> Codes:
        """Return the index of the value of an axis in some runs, (runs,)."""
        if not axis.in_turn:
            return np.asarray(self._sample(axis.name, runs, axis.sampler.sample_indices))
        sizes = [len(each.values or ()) for each in self.in_turn]
        digits = np.unravel_index(runs % self.cells, sizes)
        codes: Codes = digits[self.in_turn.index(axis)]
        return codes

    def numbers(self, axis: StudyAxis, runs: Codes) -> Array:
        """Return the numbers (runs, ...) of an axis in some runs, in SI units."""
        if axis.values is not None:
            return np.array(list(axis.values.values()), dtype=float)[self.codes(axis, runs)]
        return np.asarray(self._sample(axis.name, runs, axis.numbers))

    def _sample(self, name: str, runs: Codes, draw: Callable[[RandomNumbers], Any]) -> Any:
        """Return the samples of some runs, computed once for each draw."""
        own, where = np.unique(runs // self.cells, return_inverse=True)
        return draw(self.source(name, own))[where]


def make_plan(
    experiment: Any,
    runs: Any,
    seed: Any = None,
    start: Any = None,
    vary: Any = None,
    trajectories: Any = None,
    measures: Any = False,
) -> Plan:
    """Return the plan of a study; raise InputError if the arguments describe none."""
    base = check_instance(experiment, Experiment, "experiment")
    if isinstance(base.task, SelfSimulatingTask):
        raise InputError("a mission has no single end to count; study one of its phases")
    if base.varied:
        raise InputError(
            "this experiment has numbers that differ from run to run: give them in vary="
        )
    seed = base.seed if seed is None else as_integer(seed, "seed", 0, 2**64)
    base = base.with_(seed=seed, first_run=0, record="summary")
    base, own, q0 = _split_start(base, start)
    pairs = _list_varied(vary)
    _check_varied_names([str(name) for name, _ in pairs], trajectories is not None)
    axes = tuple(make_axis(base, name, each) for name, each in pairs)
    _check_nominal_axes(axes)
    every = None if trajectories is None else as_integer(trajectories, "trajectories", 1, 10**7)
    settings = own, q0, every, as_bool(measures, "measures")
    plan = _validate_axes(Plan(base, _count_draws(q0, runs), seed, axes, *settings))
    if plan.cells > MOST_CELLS:
        raise InputError(f"vary: {plan.cells} combinations of values; at most {MOST_CELLS}")
    for axis in axes:
        available = count_given_values(axis.sampler)
        if available is not None and available < plan.draws:
            raise InputError(
                f"runs: {plan.draws}, but {axis.name} has values for {available} draws only"
            )
    if plan.draws > MOST_EVEN and any(is_sobol(axis.sampler) for axis in axes):
        raise InputError(f"runs: Sobol's sequence has {MOST_EVEN} points, got {plan.draws}")
    return plan


def _validate_axes(plan: Plan) -> Plan:
    """Return the plan, with the samples of the first draws checked."""
    first = np.arange(min(plan.draws, CHECKED_DRAWS))
    axes = [
        axis
        if axis.values is not None
        else axis.check(plan.experiment, plan.numbers(axis, first * plan.cells))
        for axis in plan.axes
    ]
    return replace(plan, axes=tuple(axes))


def _list_varied(vary: Any) -> list[tuple[Any, Any]]:
    """Return the varied names with their values."""
    if vary is None:
        return []
    if not isinstance(vary, Mapping):
        raise InputError(f"vary: expected {{name: sampler or list}}, got {format_value(vary)}")
    return list(vary.items())


def _count_draws(q0: Array | None, runs: Any) -> int:
    """Return the number of draws: `runs`, or one for each given start."""
    start_count = None if q0 is None else len(q0)
    if runs is None:
        if start_count is None:
            raise InputError("runs: expected a whole number")
        return start_count
    count = as_integer(runs, "runs", 1, MOST_RUNS + 1)
    if start_count is not None and count != start_count:
        raise InputError(f"runs: {count}, but {start_count} starts are given; omit one of them")
    return count


def _split_start(base: Experiment, start: Any) -> tuple[Experiment, Start | None, Array | None]:
    """Return the experiment with a single start, the sampler of starts, and the given starts."""
    if type(start) is Uniform:
        start = Anywhere(low=start.low, high=start.high)
    if isinstance(start, Start):
        return base.with_(start=None), start, None
    if isinstance(start, type) or hasattr(start, "sample_values"):
        raise InputError(
            "start: expected starts (nq,) or (B, nq), rs.samplers.Uniform(low, high), or a sampler "
            f"of poses such as rs.starts.LookAt(...), got {format_value(start)}"
        )
    q0 = base.start if start is None else check_starts(base.scene, start, "start")
    if q0 is not None and q0.ndim > 1:
        return base.with_(start=None), None, q0
    return base.with_(start=q0), None, None


def _check_varied_names(names: list[str], trajectories: bool) -> None:
    """Raise InputError for names that cannot be varied, or that determine each other."""
    for name in names:
        top, _, key = name.partition(".")
        if top == START_NAME:
            raise InputError(f"vary: {name}: starts are given by start=")
        if name in ("run.seed", "run.first_run", "run.record"):
            raise InputError(f"vary: {name}: the study sets it for each run; give seed=")
        if top in ("study", "title", "display", "schema") or key.endswith(".home"):
            raise InputError(f"vary: {name}: no run depends on it")
        if trajectories and name in ("run", "run.dt", "run.duration"):
            raise InputError(f"trajectories: all runs need the same instants, but {name} varies")
    for one, other in permutations(names, 2):
        if other.startswith(f"{one}.") and one != "task":
            raise InputError(f"vary: {one} and {other}: one is a part of the other")
        if _is_same_quantity(one, other):
            raise InputError(
                f"vary: {one} and {other}: both describe the same quantity; give one of them"
            )


def _is_same_quantity(one: str, other: str) -> bool:
    """Return whether two names describe the same rotation, or the same intrinsics."""
    (owner, _, key), (other_owner, _, other_key) = one.rpartition("."), other.rpartition(".")
    turns = {"rpy", "rotvec", "rotation"}
    lens = key == "K" and other_key in {"focal", "center", "skew"}
    return owner == other_owner and ({key, other_key} <= turns or lens)


def _check_nominal_axes(axes: tuple[StudyAxis, ...]) -> None:
    """Raise InputError if `Sum` or `Product` changes a value that another axis replaces."""
    for axis in axes:
        if axis.nominal is None:
            continue
        for other in axes:
            if axis.name.startswith(f"{other.name}."):
                raise InputError(
                    f"vary: {axis.name}: {type(axis.sampler).__name__} changes the value of the "
                    f"experiment, which {other.name} replaces; give numbers"
                )
