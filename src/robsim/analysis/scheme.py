"""One of the schemes that are compared, and how it is simulated and measured."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from robsim.analysis.measures import MEASURES
from robsim.analysis.recorded import Recorded, blocks, runs_in_a_block
from robsim.base import interrupt
from robsim.base.arrays import Array
from robsim.base.errors import Interrupted, RankWarning, naming
from robsim.base.threads import processors
from robsim.engine.outcome import Outcome
from robsim.engine.workers import Progress
from robsim.files.table import Run
from robsim.run.checks import whole_periods
from robsim.run.experiment import Experiment
from robsim.world.scene import Scene

Measures = dict[str, Array]  # (B,) of each measure
T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Scheme:
    """One of the schemes that are compared: a name, an experiment, and threads and chunk."""

    name: str
    experiment: Experiment
    how: Mapping[str, Any] = field(default_factory=dict)
    recorded: xr.Dataset | None = None  # what is measured instead of a simulation

    def check(self) -> None:
        """Bind the task and check start and settings, as a run would; errors name the scheme."""
        with naming(f"scheme '{self.name}'"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # the run gives the warning
            self.experiment.check(view=False)

    def run(self, progress: Progress | None = None) -> xr.Dataset:
        """Simulate the scheme and return its run, or the one that was recorded."""
        if self.recorded is not None:
            return self.recorded
        with naming(f"scheme '{self.name}'"):
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


def run_and_measure(scheme: Scheme, progress: Progress | None) -> tuple[xr.Dataset, Measures]:
    """Return the run of a scheme and its measures; Interrupted holds what there is.

    With record="summary" every instant is measured, some runs at a time, and the ends are kept.
    """
    if scheme.experiment.record == "summary":
        return _summarised(scheme, progress)
    scene = scheme.experiment.scene
    try:
        run = scheme.run(progress)
    except Interrupted as stop:
        raise Interrupted(str(stop), (stop.run, measured(scene, stop.run))) from None
    return run, measured(scene, run)


def measured(scene: Scene, run: xr.Dataset) -> Measures:
    """Return the measures of a run or a batch in its scene, computed by several threads."""
    with ThreadPoolExecutor(processors()) as pool:
        return joined(list(pool.map(_of, (Recorded(part, scene) for part in blocks(run)))))


def joined(parts: list[Measures]) -> Measures:
    """Return the measures of several batches as those of one."""
    return {key: np.concatenate([part[key] for part in parts]) for key in MEASURES}


def _of(some: Recorded) -> Measures:
    with np.errstate(all="ignore"):  # failed runs give NaN
        return {key: each.of(some) for key, each in MEASURES.items()}


def _summarised(scheme: Scheme, progress: Progress | None) -> tuple[Run, Measures]:
    """Simulate a scheme in parts, of which only measures and ends are kept."""
    ends: list[xr.Dataset] = []
    found: list[Measures] = []

    def keep(run: xr.Dataset) -> None:
        found.append(measured(scheme.experiment.scene, run))
        ends.append(_end(run))

    try:
        for part, report in _parts(scheme, progress):
            keep(part.run(report) if not found else _quietly(part, report))
    except Interrupted as stop:
        keep(stop.run)
        raise Interrupted(str(stop), (_as_summary(scheme, ends), _whole(scheme, found))) from None
    return _as_summary(scheme, ends), _whole(scheme, found)


def _whole(scheme: Scheme, found: list[Measures]) -> Measures:
    """Return the measures of all starts; NaN for those that were not simulated."""
    parts = joined(found)
    missing = (scheme.start[..., 0].size - len(parts["time"]),)
    return {key: np.append(values, np.full(missing, np.nan)) for key, values in parts.items()}


def _parts(scheme: Scheme, progress: Progress | None) -> Iterator[tuple[Scheme, Progress | None]]:
    """Yield the scheme with a few of its starts at a time, with all instants recorded."""
    starts, scheme = scheme.start, scheme.with_(record="all")
    if starts.ndim == 1:
        yield scheme, progress
        return
    one = scheme.experiment
    size, first = runs_in_a_block(whole_periods(one.dt, one.duration) + 1), one.first_run
    for i in range(0, len(starts), size):
        some = scheme.with_(start=starts[i : i + size], first_run=first + i)
        yield some, share_of(progress, i / len(starts), min(size / len(starts), 1.0))


def until_stopped(
    steps: Sequence[Callable[[Progress | None], T]],
    made: Callable[[list[T]], R],
    progress: Progress | None,
) -> R:
    """Return what is made of the results of steps; Interrupted holds that of those before a stop.

    Each step is called with its share of the progress.
    """
    found: list[T] = []
    complete, count = True, len(steps)
    with interrupt.held(begun=False) as stops:
        for i, step in enumerate(steps):
            try:
                found.append(step(share_of(progress, i / count, 1 / count)))
            except Interrupted as stop:
                found.append(stop.run)
                complete = False
            if stops or not complete:
                break
        result = made(found)
    if stops or not complete:
        raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
    return result


def share_of(progress: Progress | None, begin: float, width: float) -> Progress | None:
    """Return a progress callback that maps the progress of a part onto that of the whole."""
    if progress is None:
        return None
    report = progress
    return lambda share: report(min(begin + width * share, 1.0))


def _end(run: xr.Dataset) -> xr.Dataset:
    """Return the instant at which each run ended, as a summary has it."""
    step = (run["end_time"] / float(run.attrs["dt"])).round().fillna(0).astype(int)
    ended = run.isel(time=step.drop_vars("time", errors="ignore")).drop_vars("time")
    return ended.transpose("run", ...) if "run" in run.dims else ended


def _as_summary(scheme: Scheme, ends: list[xr.Dataset]) -> Run:
    """Join the ends of all parts into the dataset that a summary is."""
    batch = scheme.start.ndim > 1
    with interrupt.held(deaf=True):
        like = _quietly(scheme.with_(start=scheme.start[:1]) if batch else scheme)
    whole = _concatenated(ends, int(like["run"][0]), len(scheme.start)) if batch else ends[0]
    return Run(whole[list(like.data_vars)].data_vars, whole.coords, like.attrs)


def _quietly(scheme: Scheme, progress: Progress | None = None) -> xr.Dataset:
    """Simulate a scheme without rank warnings, which were given with the first part."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)
        return scheme.run(progress)


def _concatenated(ends: list[xr.Dataset], first: int, count: int) -> xr.Dataset:
    """Return several batches as one; runs that are missing are NaN, with outcome RUNNING."""
    how: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
    whole: xr.Dataset = xr.concat(ends, "run", join="override", **how)
    if whole.sizes["run"] == count:
        return whole
    fill = {"outcome": np.int8(Outcome.RUNNING)}
    return whole.reindex(run=first + np.arange(count), fill_value=fill)
