"""`compare`: several tasks from the same start, measured alike."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.analysis.comparison import Comparison
from robsim.analysis.measures import MEASURES
from robsim.analysis.recorded import Recorded, blocks
from robsim.base.arrays import Array
from robsim.base.errors import InputError, Interrupted, RankWarning, suggest
from robsim.base.threads import processors
from robsim.run.outcome import Outcome
from robsim.run.simulate import Progress, check, check_progress, simulate
from robsim.servo import Task
from robsim.world.scene import Scene

_OURS = {"scene", "task", "q0", "progress"}  # keywords of simulate that are no settings
NO_START = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA, Outcome.JOINT_LIMIT)  # at time 0


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
    began = np.stack([_began(runs[scheme.name]) for scheme in done])
    ending = {
        "outcome": (dims, endings, first["outcome"].attrs),
        "began": (dims, began, {"units": "1", "long_name": "whether the start could begin"}),
    }
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
    """(B,) of each measure; threads take some runs at a time."""
    with ThreadPoolExecutor(processors()) as pool:
        parts = list(pool.map(_of, (Recorded(part, scheme.scene) for part in blocks(run))))
    return {key: np.concatenate([part[key] for part in parts]) for key in MEASURES}


def _of(some: Recorded) -> dict[str, Array]:
    with np.errstate(all="ignore"):  # a run that went wrong is data
        return {key: each.of(some) for key, each in MEASURES.items()}


def _began(run: xr.Dataset) -> NDArray[np.bool_]:
    """() or (B,): whether a start was in sight and within limits, so that a scheme had its turn."""
    at_once = run["end_time"].values == 0.0
    return np.asarray(~(at_once & np.isin(run["outcome"].values, NO_START)))


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
