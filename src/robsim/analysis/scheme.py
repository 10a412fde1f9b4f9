"""One of the schemes that are compared, and how it is run and measured."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from robsim.analysis.measures import MEASURES
from robsim.analysis.recorded import Recorded, blocks, runs_in_a_block
from robsim.base.arrays import Array
from robsim.base.errors import InputError, Interrupted, RankWarning
from robsim.base.threads import processors
from robsim.files.table import Run
from robsim.run.outcome import Outcome
from robsim.run.simulate import Progress, check, simulate, whole_periods
from robsim.servo import Task
from robsim.world.scene import Scene

Measures = dict[str, Array]  # (B,) of each measure


@dataclass(frozen=True, eq=False)
class Scheme:
    """One of those that are compared: a task in a scene, from a start, with keywords of simulate.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("visp_tutorial"))
    >>> Scheme("mine", one.scene, one.task, one.start, {"duration": 1.0}).name
    'mine'
    """

    name: str
    scene: Scene
    task: Task
    q0: Any = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"a scheme is called by a text, got {self.name!r:.80}")
        if not isinstance(self.scene, Scene):
            raise InputError(f"scene: expected a Scene, got {self.scene!r:.80}")
        if isinstance(self.task, type) or not isinstance(self.task, Task):
            raise InputError(
                f"scheme '{self.name}': expected a task such as IBVS(...), got {self.task!r:.80}"
            )

    def check(self) -> None:
        """Bind the task and try start and settings, as a run would; errors name the scheme."""
        self._named(self._try)

    def run(self, progress: Progress | None = None) -> xr.Dataset:
        """Simulate it."""
        told = {**self.settings, "progress": progress}
        run: xr.Dataset = self._named(partial(simulate, self.scene, self.task, self.q0, **told))
        return run

    @property
    def start(self) -> Array:
        """(nq,) or (B, nq)."""
        return self.scene.coordinates(self.scene.home if self.q0 is None else self.q0, "q0")

    def _try(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # it comes with the run
            check(self.scene, self.task, self.q0, self.settings)

    def _named(self, what: Any) -> Any:
        try:
            return what()
        except InputError as error:
            raise type(error)(f"scheme '{self.name}': {error}") from None


def run_and_measure(scheme: Scheme, progress: Progress | None) -> tuple[xr.Dataset, Measures]:
    """Return the run of a scheme and its measures; Interrupted holds both as far as they came.

    With record="summary" every instant is measured, some runs at a time, and the ends are kept.
    """
    if scheme.settings.get("record") == "summary":
        return _summarised(scheme, progress)
    try:
        run = scheme.run(progress)
    except Interrupted as stop:
        raise Interrupted(str(stop), (stop.run, measured(scheme, stop.run))) from None
    return run, measured(scheme, run)


def measured(scheme: Scheme, run: xr.Dataset) -> Measures:
    """Return the measures of a run or a batch; threads take some runs at a time."""
    with ThreadPoolExecutor(processors()) as pool:
        parts = list(pool.map(_of, (Recorded(part, scheme.scene) for part in blocks(run))))
    return joined(parts)


def joined(parts: list[Measures]) -> Measures:
    """Return the measures of runs one after another."""
    return {key: np.concatenate([part[key] for part in parts]) for key in MEASURES}


def _of(some: Recorded) -> Measures:
    with np.errstate(all="ignore"):  # a run that went wrong is data
        return {key: each.of(some) for key, each in MEASURES.items()}


def _summarised(scheme: Scheme, progress: Progress | None) -> tuple[Run, Measures]:
    """All parts of a scheme, of whose runs nothing is kept but measures and ends."""
    ends: list[xr.Dataset] = []
    found: list[Measures] = []

    def keep(run: xr.Dataset) -> None:
        found.append(measured(scheme, run))
        ends.append(_end(run))

    try:
        for part, told in _parts(scheme, progress):
            keep(part.run(told) if not found else _quietly(part, told))
    except Interrupted as stop:
        keep(stop.run)
        raise Interrupted(str(stop), (_as_summary(scheme, ends), _whole(scheme, found))) from None
    return _as_summary(scheme, ends), _whole(scheme, found)


def _whole(scheme: Scheme, found: list[Measures]) -> Measures:
    """The measures of all starts; NaN of those that an interruption left."""
    parts = joined(found)
    missing = (scheme.start[..., 0].size - len(parts["time"]),)
    return {key: np.append(values, np.full(missing, np.nan)) for key, values in parts.items()}


def _parts(scheme: Scheme, progress: Progress | None) -> Iterator[tuple[Scheme, Progress | None]]:
    """The scheme from some of its starts at a time, all instants recorded."""
    starts, settings = scheme.start, {**scheme.settings, "record": "all"}
    if starts.ndim == 1:
        yield replace(scheme, settings=settings), progress
        return
    steps = whole_periods(settings.get("dt", 0.04), settings.get("duration", 10.0))
    size, first = runs_in_a_block(steps + 1), settings.get("run", 0)
    for i in range(0, len(starts), size):
        some = replace(scheme, q0=starts[i : i + size], settings={**settings, "run": first + i})
        yield some, share_of(progress, i / len(starts), min(size / len(starts), 1.0))


def share_of(progress: Progress | None, begin: float, width: float) -> Progress | None:
    """Return the progress of a part, which begins at a share of the whole, as that of the whole."""
    if progress is None:
        return None
    told = progress
    return lambda share: told(min(begin + width * share, 1.0))


def _end(run: xr.Dataset) -> xr.Dataset:
    """The instant at which each run ended, as a summary has it."""
    step = (run["end_time"] / float(run.attrs["dt"])).round().fillna(0).astype(int)
    ended = run.isel(time=step.drop_vars("time", errors="ignore")).drop_vars("time")
    return ended.transpose("run", ...) if "run" in run.dims else ended


def _as_summary(scheme: Scheme, ends: list[xr.Dataset]) -> Run:
    """Ends one after another, with what a summary of the first start says of all."""
    batch = scheme.start.ndim > 1
    like = _quietly(replace(scheme, q0=scheme.start[:1] if batch else scheme.start))
    whole = _concatenated(ends, int(like["run"][0]), len(scheme.start)) if batch else ends[0]
    return Run(whole[list(like.data_vars)].data_vars, whole.coords, like.attrs)


def _quietly(scheme: Scheme, progress: Progress | None = None) -> xr.Dataset:
    """Its run; what is weak about the task was told with the first part."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)
        return scheme.run(progress)


def _concatenated(ends: list[xr.Dataset], first: int, count: int) -> xr.Dataset:
    """The runs of several batches; those that an interruption left are NaN, and running."""
    how: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
    whole: xr.Dataset = xr.concat(ends, "run", join="override", **how)
    if whole.sizes["run"] == count:
        return whole
    fill = {"outcome": np.int8(Outcome.RUNNING)}
    return whole.reindex(run=first + np.arange(count), fill_value=fill)
