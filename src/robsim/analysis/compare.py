"""`compare`: simulate several tasks from the same start and measure them alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from robsim.analysis.comparison import Comparison
from robsim.analysis.measures import MEASURES
from robsim.analysis.scheme import Measures, Scheme, run_and_measure, until_stopped
from robsim.base.errors import InputError, naming, said, suggest
from robsim.engine.workers import Progress, check_progress
from robsim.run.checks import of_kind, starts
from robsim.run.commanded import is_recorded
from robsim.run.ends import began
from robsim.run.experiment import Experiment
from robsim.run.staged import Staged
from robsim.servo.tasks.task import Task
from robsim.world.scene import Scene


def compare(
    scene: Scene | Mapping[str, Experiment | xr.Dataset],
    tasks: Mapping[str, Task] | None = None,
    q0: Any = None,
    *,
    progress: Progress | None = None,
    threads: int | None = None,
    chunk: int = 256,
    **settings: Any,
) -> Comparison:
    """Run several tasks, {name: task}, in one scene from the same start, and measure them alike.

    q0          start (nq,), or a batch of them (B, nq), or {robot: q}; None is home
    settings    fields of `Experiment`, the same for all, and so are seed and run numbers; with
                record="summary" all instants are measured and the ends alone are kept, for many
                thousands of starts

    `compare(experiments)` with {name: experiment} compares experiments that may differ in
    everything, but have as many starts each; instead of one, a run that was recorded (`open_bag`,
    `read_log`) is measured as it is. The measures are those of Gans, Hutchinson and Corke
    2003 in spirit: see `robsim.analysis.measures`. Of a batch the table has the share that
    converged and medians.

    InputError or GoalError names the scheme, before anything runs; Interrupted after Ctrl-C, whose
    `run` is the Comparison of what was simulated so far.

    >>> from robsim import IBVS, PBVS, load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("camera_retreat")).with_(dt=0.02, duration=15)
    >>> goal = one.task.goal
    >>> found = compare({"image": one.with_(task=IBVS(goal)), "pose": one.with_(task=PBVS(goal))})
    >>> found.data.retreat.round(2).values
    array([1.03, 0.  ])
    """
    check_progress(progress)
    experiments = _experiments(scene, tasks, q0, settings)
    how = {"threads": threads, "chunk": chunk}
    schemes = [_scheme(name, one, how) for name, one in experiments.items()]
    _check(schemes)
    steps = [partial(run_and_measure, scheme) for scheme in schemes]
    return until_stopped(steps, partial(_comparison, schemes), progress)


def _scheme(name: str, one: Any, how: Mapping[str, Any]) -> Scheme:
    """Return the scheme of an experiment, or of a run that was recorded."""
    if not isinstance(one, xr.Dataset):
        return Scheme(name, one, how)
    with naming(f"scheme '{name}'"):
        if not is_recorded(one):
            raise InputError("a run that was simulated; give its experiment, Experiment.of(run)")
        return Scheme(name, Experiment.of(one), how, one)


def _experiments(
    scene: Scene | Mapping[str, Any], tasks: Any, q0: Any, settings: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return the experiment of each name; InputError names the scheme."""
    if isinstance(scene, Mapping):
        if tasks is not None or q0 is not None or settings:
            raise InputError("experiments have their own tasks, starts and settings: give none")
        return _by_name(scene, "experiments by name, as in {'mine': experiment}")
    known = [each.name for each in fields(Experiment) if each.name not in _OURS]
    for key in settings:
        if key not in known:
            raise InputError(f"no setting {key!r}; {suggest(key, known, 'settings')}")
    scene = of_kind(scene, Scene, "scene")
    start = None if q0 is None else starts(scene, q0, "q0")
    made = {}
    for name, task in _by_name(tasks, "tasks by name, as in {'mine': IBVS()}").items():
        with naming(f"scheme '{name}'"):
            made[name] = Experiment(scene, task, start, **settings)
    return made


_OURS = ("scene", "task", "start", "varied", "source", "title")  # fields that are not settings


def _by_name(value: Any, wanted: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping) or not value:
        raise InputError(f"expected {wanted}, got {said(value)}")
    for name in value:
        if not isinstance(name, str) or not name:
            raise InputError(f"a scheme is called by a text, got {said(name)}")
    return value


def _check(schemes: Sequence[Scheme]) -> None:
    """Raise InputError for a scheme that is refused, and for unequal numbers of starts."""
    for scheme in schemes:
        one = of_kind(scheme.experiment, Experiment, f"scheme '{scheme.name}'")
        if isinstance(one.task, Staged):
            raise InputError(
                f"scheme '{scheme.name}': a mission has no single error and is not compared; "
                "compare tasks of its phases"
            )
        if one.varied:
            raise InputError(
                f"scheme '{scheme.name}': its numbers differ from run to run, and its scene with "
                "them; compare what its run has for each"
            )
        scheme.check()
    batches = {scheme.start.shape[:-1] for scheme in schemes}
    if len(batches) > 1:
        raise InputError(f"q0: every scheme needs as many starts as the others, got {batches}")


def _comparison(
    schemes: Sequence[Scheme], found: Sequence[tuple[xr.Dataset, Measures]]
) -> Comparison:
    """Return the comparison of the first schemes, from the run and the measures of each."""
    done, ran = schemes[: len(found)], [run for run, _ in found]
    first = ran[0]
    dims = ("scheme", *(("run",) if "run" in first.dims else ()))
    shape = (len(done), *(first.sizes[dim] for dim in dims[1:]))
    data = {
        key: (
            dims,
            np.stack([values[key] for _, values in found]).reshape(shape),
            {"units": each.unit, "long_name": each.meaning},
        )
        for key, each in MEASURES.items()
    }
    begun = np.stack([began(run["outcome"].values, run["end_time"].values) for run in ran])
    ending = {
        "outcome": (dims, np.stack([run["outcome"].values for run in ran]), first["outcome"].attrs),
        "began": (dims, begun, {"units": "1", "long_name": "whether the start could begin"}),
    }
    names = [scheme.name for scheme in done]
    coordinates = {"scheme": names, **{dim: first[dim].values for dim in dims[1:]}}
    attributes = {"title": "RobSim comparison", "robsim": first.attrs["robsim"]}
    return Comparison(
        dict(zip(names, ran, strict=True)),
        xr.Dataset({**ending, **data}, coordinates, attributes),
        {scheme.name: scheme.experiment.scene for scheme in done},
        tuple(_differences(done)),
    )


def _differences(schemes: Sequence[Scheme]) -> Iterable[str]:
    """Yield a note for everything but the task that differs between schemes."""
    first, *others = schemes
    one = first.experiment
    differ = {
        "another scene": [x.name for x in others if x.experiment.scene != one.scene],
        "another start": [x.name for x in others if not np.array_equal(x.start, first.start)],
        "other run settings": [x.name for x in others if _settings(x) != _settings(first)],
    }
    for what, names in differ.items():
        if names:
            yield f"note: {what} than {first.name}: {', '.join(names)}"


def _settings(scheme: Scheme) -> dict[str, Any]:
    return {**scheme.experiment.settings, "title": None}
