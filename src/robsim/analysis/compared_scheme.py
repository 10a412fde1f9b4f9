"""A scheme of a comparison: its simulation and its measures."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from robsim.analysis.measures import MEASURES
from robsim.analysis.run_arrays import RecordedRuns, count_block_runs, split_runs
from robsim.base import interrupt
from robsim.base.arrays import Array
from robsim.base.errors import Interrupted, RankWarning, prefix_errors
from robsim.base.processors import count_processors
from robsim.engine.outcome import Outcome
from robsim.engine.workers import Progress
from robsim.files.flat_table import RunDataset
from robsim.run.experiment import Experiment
from robsim.run.run_checks import count_periods
from robsim.world.scene import Scene

MeasureArrays = dict[str, Array]  # an array (B,) for each measure
T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Scheme:
    """A scheme of a comparison: a name, an experiment, and how it is simulated."""

    name: str
    experiment: Experiment
    how: Mapping[str, Any] = field(default_factory=dict)  # arguments `threads` and `chunk` of a run
    recorded: xr.Dataset | None = None  # a recorded run, measured without simulation

    def check(self) -> None:
        """Bind the task and check start and settings as a run does; errors name the scheme."""
        with prefix_errors(f"scheme '{self.name}'"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # the run gives the warning
            self.experiment.check(view=False)

    def run(self, progress: Progress | None = None) -> xr.Dataset:
        """Return the recorded run, or simulate the scheme."""
        if self.recorded is not None:
            return self.recorded
        with prefix_errors(f"scheme '{self.name}'"):
            run: xr.Dataset = self.experiment.run(progress, **self.how)
        return run

    @property
    def start(self) -> Array:
        """The start (nq,) or the batch of starts (B, nq)."""
        own = self.experiment.start
        return self.experiment.scene.home if own is None else own

    def with_(self, **changes: Any) -> Scheme:
        """Return the scheme with other fields of its experiment."""
        return replace(self, experiment=self.experiment.with_(**changes))


def run_and_measure(scheme: Scheme, progress: Progress | None) -> tuple[xr.Dataset, MeasureArrays]:
    """Return the run of a scheme and its measures; Interrupted carries the finished part.

    With record="summary" the measures use every instant of some runs at a time, and only the final
    states are stored.
    """
    if scheme.experiment.record == "summary":
        return _simulate_summary(scheme, progress)
    scene = scheme.experiment.scene
    try:
        run = scheme.run(progress)
    except Interrupted as stop:
        raise Interrupted(str(stop), (stop.run, measure_run(scene, stop.run))) from None
    return run, measure_run(scene, run)


def measure_run(scene: Scene, run: xr.Dataset) -> MeasureArrays:
    """Return the measures of a run or a batch in its scene, computed by several threads."""
    with ThreadPoolExecutor(count_processors()) as pool:
        return join_measures(
            list(pool.map(_measure_block, (RecordedRuns(part, scene) for part in split_runs(run))))
        )


def join_measures(parts: list[MeasureArrays]) -> MeasureArrays:
    """Return the measures of several batches, concatenated."""
    return {key: np.concatenate([part[key] for part in parts]) for key in MEASURES}


def _measure_block(some: RecordedRuns) -> MeasureArrays:
    """Return the measures of recorded runs; NaN for failed runs."""
    with np.errstate(all="ignore"):  # failed runs
        return {key: each.of(some) for key, each in MEASURES.items()}


def _simulate_summary(
    scheme: Scheme, progress: Progress | None
) -> tuple[RunDataset, MeasureArrays]:
    """Simulate a scheme in parts, and store only the measures and final states of each part."""
    ends: list[xr.Dataset] = []
    measures: list[MeasureArrays] = []

    def keep(run: xr.Dataset) -> None:
        measures.append(measure_run(scheme.experiment.scene, run))
        ends.append(_select_final_instants(run))

    try:
        for part, report in _split_scheme(scheme, progress):
            keep(part.run(report) if not measures else _run_quietly(part, report))
    except Interrupted as stop:
        keep(stop.run)
        raise Interrupted(
            str(stop), (_assemble_summary(scheme, ends), _pad_measures(scheme, measures))
        ) from None
    return _assemble_summary(scheme, ends), _pad_measures(scheme, measures)


def _pad_measures(scheme: Scheme, finished: list[MeasureArrays]) -> MeasureArrays:
    """Return the measures of all starts; NaN for starts that were not simulated."""
    measures = join_measures(finished)
    missing = (scheme.start[..., 0].size - len(measures["time"]),)
    return {key: np.append(values, np.full(missing, np.nan)) for key, values in measures.items()}


def _split_scheme(
    scheme: Scheme, progress: Progress | None
) -> Iterator[tuple[Scheme, Progress | None]]:
    """Yield the scheme with a few of its starts at a time, and all instants recorded."""
    starts, scheme = scheme.start, scheme.with_(record="all")
    if starts.ndim == 1:
        yield scheme, progress
        return
    one = scheme.experiment
    size, first = count_block_runs(count_periods(one.dt, one.duration) + 1), one.first_run
    for i in range(0, len(starts), size):
        part = scheme.with_(start=starts[i : i + size], first_run=first + i)
        yield part, scale_progress(progress, i / len(starts), min(size / len(starts), 1.0))


def run_steps(
    steps: Sequence[Callable[[Progress | None], T]],
    combine: Callable[[list[T]], R],
    progress: Progress | None,
) -> R:
    """Return `combine` of the results of all steps.

    Each step is called with its share of the progress. After a stop Interrupted is raised, with
    `combine` of the finished results.
    """
    results: list[T] = []
    complete, count = True, len(steps)
    with interrupt.defer_stops(begun=False) as stops:
        for i, step in enumerate(steps):
            try:
                results.append(step(scale_progress(progress, i / count, 1 / count)))
            except Interrupted as stop:
                results.append(stop.run)
                complete = False
            if stops or not complete:
                break
        result = combine(results)
    if stops or not complete:
        raise Interrupted("stopped by the user; the finished runs are in .run", result)
    return result


def scale_progress(progress: Progress | None, begin: float, width: float) -> Progress | None:
    """Return a progress callback that maps the progress of a part onto the total progress."""
    if progress is None:
        return None
    report = progress
    return lambda share: report(min(begin + width * share, 1.0))


def _select_final_instants(run: xr.Dataset) -> xr.Dataset:
    """Return the last instant of each run, as in a summary."""
    step = (run["end_time"] / float(run.attrs["dt"])).round().fillna(0).astype(int)
    ended = run.isel(time=step.drop_vars("time", errors="ignore")).drop_vars("time")
    return ended.transpose("run", ...) if "run" in run.dims else ended


def _assemble_summary(scheme: Scheme, ends: list[xr.Dataset]) -> RunDataset:
    """Return the final states of all parts as one summary dataset."""
    batch = scheme.start.ndim > 1
    with interrupt.defer_stops(deaf=True):
        template = _run_quietly(scheme.with_(start=scheme.start[:1]) if batch else scheme)
    count = len(scheme.start)
    whole = _concatenate_ends(ends, int(template["run"][0]), count) if batch else ends[0]
    return RunDataset(whole[list(template.data_vars)].data_vars, whole.coords, template.attrs)


def _run_quietly(scheme: Scheme, progress: Progress | None = None) -> xr.Dataset:
    """Simulate a scheme without rank warnings, which its first part has already given."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)
        return scheme.run(progress)


def _concatenate_ends(ends: list[xr.Dataset], first: int, count: int) -> xr.Dataset:
    """Return the batches as one dataset; missing runs are NaN, with outcome RUNNING."""
    how: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
    whole: xr.Dataset = xr.concat(ends, "run", join="override", **how)
    if whole.sizes["run"] == count:
        return whole
    fill = {"outcome": np.int8(Outcome.RUNNING)}
    return whole.reindex(run=first + np.arange(count), fill_value=fill)
