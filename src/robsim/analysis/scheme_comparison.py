"""`compare`: simulate several tasks from the same start and measure them alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from robsim.analysis.compared_scheme import MeasureArrays, Scheme, run_and_measure, run_steps
from robsim.analysis.comparison import Comparison
from robsim.analysis.measures import MEASURES
from robsim.base.errors import InputError, format_value, prefix_errors, suggest_names
from robsim.engine.workers import Progress, check_progress
from robsim.run.end_variables import is_valid_start
from robsim.run.experiment import Experiment
from robsim.run.log_commands import is_log_run
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.run.run_checks import check_instance, check_starts
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
    everything, but have as many starts each; instead of one, a run that was recorded (`read_bag`,
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
    experiments = _make_experiments(scene, tasks, q0, settings)
    how = {"threads": threads, "chunk": chunk}
    schemes = [_make_scheme(name, one, how) for name, one in experiments.items()]
    _check_schemes(schemes)
    steps = [partial(run_and_measure, scheme) for scheme in schemes]
    return run_steps(steps, partial(_assemble_comparison, schemes), progress)


def _make_scheme(name: str, one: Any, how: Mapping[str, Any]) -> Scheme:
    """Return the scheme of an experiment, or of a run that was recorded."""
    if not isinstance(one, xr.Dataset):
        return Scheme(name, one, how)
    with prefix_errors(f"scheme '{name}'"):
        if not is_log_run(one):
            raise InputError("a run that was simulated; give its experiment, Experiment.of(run)")
        return Scheme(name, Experiment.of(one), how, one)


def _make_experiments(
    scene: Scene | Mapping[str, Any], tasks: Any, q0: Any, settings: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return the experiment of each name; InputError names the scheme."""
    if isinstance(scene, Mapping):
        if tasks is not None or q0 is not None or settings:
            raise InputError("experiments have their own tasks, starts and settings: give none")
        return _check_name_mapping(scene, "experiments by name, as in {'mine': experiment}")
    known = [each.name for each in fields(Experiment) if each.name not in _OWN_FIELDS]
    for key in settings:
        if key not in known:
            raise InputError(f"no setting {key!r}; {suggest_names(key, known, 'settings')}")
    scene = check_instance(scene, Scene, "scene")
    start = None if q0 is None else check_starts(scene, q0, "q0")
    made = {}
    for name, task in _check_name_mapping(tasks, "tasks by name, as in {'mine': IBVS()}").items():
        with prefix_errors(f"scheme '{name}'"):
            made[name] = Experiment(scene, task, start, **settings)
    return made


_OWN_FIELDS = (
    "scene",
    "task",
    "start",
    "varied",
    "source",
    "title",
)  # fields that are not settings


def _check_name_mapping(value: Any, wanted: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping) or not value:
        raise InputError(f"expected {wanted}, got {format_value(value)}")
    for name in value:
        if not isinstance(name, str) or not name:
            raise InputError(f"a scheme is called by a text, got {format_value(name)}")
    return value


def _check_schemes(schemes: Sequence[Scheme]) -> None:
    """Raise InputError for a scheme that is refused, and for unequal numbers of starts."""
    for scheme in schemes:
        one = check_instance(scheme.experiment, Experiment, f"scheme '{scheme.name}'")
        if isinstance(one.task, SelfSimulatingTask):
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


def _assemble_comparison(
    schemes: Sequence[Scheme], found: Sequence[tuple[xr.Dataset, MeasureArrays]]
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
    begun = np.stack([is_valid_start(run["outcome"].values, run["end_time"].values) for run in ran])
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
        tuple(_describe_differences(done)),
    )


def _describe_differences(schemes: Sequence[Scheme]) -> Iterable[str]:
    """Yield a note for everything but the task that differs between schemes."""
    first, *others = schemes
    one = first.experiment
    differ = {
        "another scene": [x.name for x in others if x.experiment.scene != one.scene],
        "another start": [x.name for x in others if not np.array_equal(x.start, first.start)],
        "other run settings": [
            x.name for x in others if _shared_settings(x) != _shared_settings(first)
        ],
    }
    for what, names in differ.items():
        if names:
            yield f"note: {what} than {first.name}: {', '.join(names)}"


def _shared_settings(scheme: Scheme) -> dict[str, Any]:
    return {**scheme.experiment.settings, "title": None}
