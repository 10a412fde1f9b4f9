"""`compare`: several tasks from the same start, measured alike."""

from __future__ import annotations

import csv
import inspect
import io
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from robsim.analysis.measures import MEASURES, distance, first_pair, retreat
from robsim.base.arrays import Array, not_negative
from robsim.base.errors import InputError, Interrupted, RankWarning, suggest
from robsim.base.html import table
from robsim.run.outcome import Outcome
from robsim.run.result import BLOCK
from robsim.run.simulate import Progress, check, check_progress, simulate
from robsim.servo import GoalPose, Task, TaughtGoal
from robsim.world.scene import Scene

_OURS = {"scene", "task", "q0", "progress"}  # keywords of simulate that are no settings


@dataclass(frozen=True, eq=False)
class Scheme:
    """One of those that are compared: a task in a scene, from a start, with keywords of simulate.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("visp_tutorial"))
    >>> Scheme("mine", one.scene, one.task, one.q0, {"duration": 1.0}).name
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


@dataclass(frozen=True, eq=False)
class Comparison:
    """The runs of several schemes, and their measures; as text, a table.

    `runs` and `scenes` are by the name of the scheme. `data` has a variable for each measure (see
    `robsim.analysis.measures`), with dims (scheme,) or of batches (scheme, run), and the outcome;
    NaN where a measure is undefined. `notes` say what besides the task differs.
    """

    runs: Mapping[str, xr.Dataset]
    data: xr.Dataset
    scenes: Mapping[str, Scene]
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Of the schemes, in the order given."""
        return tuple(self.runs)

    @property
    def batch(self) -> bool:
        """Whether every scheme ran from several starts."""
        return "run" in self.data.dims

    def converged(self) -> xr.DataArray:
        """The share of the runs of each scheme that converged, 0 to 1."""
        arrived = (self.data["outcome"] == Outcome.CONVERGED).astype(float)
        return arrived.mean("run") if self.batch else arrived

    def quantile(self, share: float = 0.5) -> xr.Dataset:
        """Of a batch, for each scheme the quantile of each measure over the runs that converged.

        0.5 is the median. Of single runs: their measures. InputError: a share beyond 0 and 1.
        """
        share = not_negative(share, "share of a quantile")
        if share > 1:
            raise InputError(f"share of a quantile: expected 0 to 1, got {share:g}")
        if not self.batch:
            return self.data.drop_vars("outcome")
        arrived = self.data["outcome"] == Outcome.CONVERGED
        found = {name: _quantile(self.data[name].where(arrived), share) for name in MEASURES}
        return xr.Dataset(found, attrs=self.data.attrs)

    def csv(self) -> str:
        """The table as comma-separated values, with all measures, in full precision."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        units = [f"{name} ({each.unit})" for name, each in MEASURES.items()]
        rows.writerow(["scheme", "converged (1)" if self.batch else "outcome", *units])
        numbers = self.quantile()
        for i, name in enumerate(self.names):
            values = [float(numbers[key][i]) for key in MEASURES]
            told = ["" if np.isnan(value) else repr(value) for value in values]
            rows.writerow([name, self._ending(i), *told])
        return text.getvalue()

    def __str__(self) -> str:
        """Return the table; what is undefined for every scheme is left out."""
        return "\n".join([*_aligned(self._columns()), *self._remarks()])

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        first, *rows = zip(*self._columns(), strict=True)
        units, *rows = rows
        head = [
            f"{name} ({unit})" if unit else name for name, unit in zip(first, units, strict=True)
        ]
        return table("Comparison", rows, head, "\n".join(self._remarks()))

    def _columns(self) -> list[list[str]]:
        """Each with its name, its unit, and a text for each scheme."""
        numbers = self.quantile()
        shown = {key: each for key, each in MEASURES.items() if each.short}
        shown = {key: each for key, each in shown.items() if np.isfinite(numbers[key]).any()}
        columns = [["scheme", "", *self.names]]
        endings = [self._ending(i) for i in range(len(self.names))]
        columns.append(["converged" if self.batch else "outcome", "", *endings])
        for key, each in shown.items():
            unit = "" if each.unit == "1" else each.unit
            columns.append([each.short, unit, *map(_text, numbers[key].values)])
        return columns

    def _remarks(self) -> list[str]:
        """What stands below the table."""
        count = self.data.sizes.get("run")
        median = [f"medians of the runs that converged, of {count}"] if count else []
        return [*median, *self.notes]

    def __repr__(self) -> str:
        """Also where a notebook shows it."""
        return str(self)

    def _ending(self, i: int) -> str:
        if self.batch:
            return f"{float(self.converged()[i]):.4g}"
        return Outcome(int(self.data["outcome"][i])).words


def compare(
    scene: Scene,
    tasks: Mapping[str, Task],
    q0: Any = None,
    *,
    progress: Progress | None = None,
    **settings: Any,
) -> Comparison:
    """Run several tasks, {name: task}, in one scene from the same start, and measure them alike.

    q0          start (nq,), or a batch of them (B, nq), or {robot: q}; None is home
    settings    keywords of `simulate`, the same for all, and so are seed and run numbers

    The measures are those of Gans, Hutchinson and Corke 2003 in spirit: see
    `robsim.analysis.measures`. Of a batch the table has the share that converged and medians.
    InputError or GoalError names the scheme, before anything runs; Interrupted after Ctrl-C, whose
    `run` is the Comparison of what was simulated so far.

    >>> from robsim import IBVS, PBVS, load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("camera_retreat"))
    >>> goal = one.task.goal
    >>> tasks = {"image": IBVS(goal), "pose": PBVS(goal)}
    >>> found = compare(one.scene, tasks, one.q0, dt=0.02, duration=15)
    >>> found.data.retreat.round(2).values
    array([1.03, 0.  ])
    """
    if not isinstance(tasks, Mapping) or not tasks:
        raise InputError(f"expected tasks by name, as in {{'mine': IBVS()}}, got {tasks!r:.80}")
    schemes = [Scheme(name, scene, task, q0, settings) for name, task in tasks.items()]
    return compared(schemes, progress)


def compared(schemes: Sequence[Scheme], progress: Progress | None = None) -> Comparison:
    """Run schemes that may differ in everything, and measure them alike.

    InputError: two of one name; one that is refused; starts of which one is a batch and another
    is not, or is one of another size.
    """
    check_progress(progress)
    _check(schemes)
    runs: dict[str, xr.Dataset] = {}
    for i, scheme in enumerate(schemes):
        try:
            runs[scheme.name] = scheme.run(_part(progress, i, len(schemes)))
        except Interrupted as stop:
            runs[scheme.name] = stop.run
            message = "stopped by the user; what was simulated so far is in .run"
            raise Interrupted(message, _measured(schemes, runs)) from None
    return _measured(schemes, runs)


def _check(schemes: Sequence[Scheme]) -> None:
    names = [scheme.name for scheme in schemes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if not schemes or twice:
        raise InputError(f"two schemes are called '{twice[0]}'" if twice else "nothing to compare")
    known = sorted(inspect.signature(simulate).parameters.keys() - _OURS)
    for scheme in schemes:
        for key in scheme.settings:
            if key not in known:
                raise InputError(f"no setting {key!r}; {suggest(key, known, 'settings')}")
        if scheme.settings.get("record") == "summary":
            raise InputError("record='summary': a comparison measures the way, not the end alone")
        scheme.check()
    batches = {scheme.start.shape[:-1] for scheme in schemes}
    if len(batches) > 1:
        raise InputError(f"q0: every scheme needs as many starts as the others, got {batches}")


def _part(progress: Progress | None, i: int, count: int) -> Progress | None:
    """The progress of one scheme as a share of all."""
    if progress is None:
        return None
    told = progress
    return lambda share: told((i + share) / count)


def _measured(schemes: Sequence[Scheme], runs: dict[str, xr.Dataset]) -> Comparison:
    """The comparison of those that were run."""
    done = [scheme for scheme in schemes if scheme.name in runs]
    first = runs[done[0].name]
    dims = ("scheme", *(("run",) if "run" in first.dims else ()))
    shape = (len(done), *(first.sizes[dim] for dim in dims[1:]))
    values = [_measures(scheme, runs[scheme.name]) for scheme in done]
    data = {
        key: (dims, np.stack([each[key] for each in values]).reshape(shape), _attributes(key))
        for key in MEASURES
    }
    endings = np.stack([runs[scheme.name]["outcome"].values for scheme in done])
    ending = {"outcome": (dims, endings, first["outcome"].attrs)}
    coordinates = {"scheme": [scheme.name for scheme in done]}
    coordinates |= {dim: first[dim].values for dim in dims[1:]}
    attributes = {"title": "RobSim comparison", "robsim": first.attrs["robsim"]}
    return Comparison(
        runs,
        xr.Dataset({**ending, **data}, coordinates, attributes),
        {scheme.name: scheme.scene for scheme in done},
        tuple(_differences(done)),
    )


def _measures(scheme: Scheme, run: xr.Dataset) -> dict[str, Array]:
    """(B,) of each measure."""
    of: dict[str, Any] = {key: each.of for key, each in MEASURES.items()}
    of["retreat"] = partial(retreat, goal=_goal_distance(scheme, run))
    with np.errstate(all="ignore"):  # a run that went wrong is data
        parts = [{k: f(part, scheme.scene) for k, f in of.items()} for part in _blocks(run)]
    return {key: np.concatenate([part[key] for part in parts]) for key in of}


def _blocks(run: xr.Dataset) -> list[xr.Dataset]:
    """Some runs at a time, since each moment has poses and Jacobians."""
    if "run" not in run.dims:
        return [run]
    size = max(1, BLOCK // run.sizes["time"])
    return [run.isel(run=slice(i, i + size)) for i in range(0, run.sizes["run"], size)]


def _goal_distance(scheme: Scheme, run: xr.Dataset) -> float:
    """Metres from the camera to the middle of the marks at the goal; NaN if that is not told."""
    goal, scene = getattr(scheme.task, "goal", None), scheme.scene
    if isinstance(goal, TaughtGoal):
        camera, target = first_pair(run)
        q = scene.coordinates(scene.home if goal.q is None else goal.q, "goal q")
        return float(distance(scene, camera, target, q[None, None])[0, 0])
    if isinstance(goal, GoalPose):
        _, target = first_pair(run)
        return float(np.linalg.norm(goal.T_c_o @ scene.object(target).marks.mean(axis=0)))
    return np.nan


def _attributes(key: str) -> dict[str, str]:
    return {"units": MEASURES[key].unit, "long_name": MEASURES[key].meaning}


def _differences(schemes: Sequence[Scheme]) -> Iterable[str]:
    """What besides the task is not the same for all."""
    first, *others = schemes
    differ = {
        "another scene": [each.name for each in others if each.scene != first.scene],
        "another start": [
            each.name for each in others if not np.array_equal(each.start, first.start)
        ],
        "other run settings": [each.name for each in others if each.settings != first.settings],
    }
    for what, names in differ.items():
        if names:
            yield f"note: {what} than {first.name}: {', '.join(names)}"


def _quantile(values: xr.DataArray, share: float) -> xr.DataArray:
    """Along the runs; NaN counts nothing, and is all there is where there is nothing else."""
    rows = [row[np.isfinite(row)] for row in values.values]
    found = [float(np.quantile(row, share)) if row.size else np.nan for row in rows]
    return xr.DataArray(found, {"scheme": values["scheme"]}, attrs=values.attrs)


def _text(value: float) -> str:
    """Three digits; "-" where there is nothing, or what is nothing but rounding."""
    if np.isnan(value):
        return "-"
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.0f}" if 100 <= abs(value) < 1e5 else f"{value:.3g}"


def _aligned(columns: list[list[str]]) -> list[str]:
    """Lines of text from columns of it; the first two to the left, numbers to the right."""
    widths = [max(map(len, column)) for column in columns]
    padded = [
        [text.ljust(width) if i < 2 else text.rjust(width) for text in column]
        for i, (column, width) in enumerate(zip(columns, widths, strict=True))
    ]
    return ["  ".join(row).rstrip() for row in zip(*padded, strict=True)]
