"""`compare`: simulate several schemes from the same starts and compute the same measures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

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
    q0: ArrayLike | Mapping[str, ArrayLike] | None = None,
    *,
    progress: Progress | None = None,
    threads: int | None = None,
    chunk: int = 256,
    **settings: Any,  # Any: the fields of `Experiment` have different types
) -> Comparison:
    """Simulate several tasks from the same start and compute the same measures of each.

    The first form compares tasks in one scene. The second form, `compare(experiments)`, compares
    experiments, which may differ in everything except the number of starts. A recorded run
    (`read_bag`, `read_log`) may stand for an experiment; it is measured without simulation. The
    measures follow Gans, Hutchinson and Corke 2003 (see `robsim.analysis.measures`). For a batch
    the table shows the share of converged runs and medians.

    Parameters
    ----------
    scene : Scene, or mapping of str to Experiment or Dataset
        Scene of all tasks, or the experiments (or recorded runs) by name.
    tasks : mapping of str to Task, optional
        Tasks by name.
    q0 : array_like of shape (nq,) or (B, nq), or mapping of str to array_like, optional
        Start, batch of starts, or start of each robot by name. Default: the home configuration.
    progress : callable, optional
        Function that is called with the finished share, 0 to 1.
    threads : int, optional
        Number of threads. Default: one for each processor.
    chunk : int, default 256
        Number of runs that are simulated in lockstep.
    **settings
        Fields of `Experiment`, the same for all tasks; seed and run numbers are the same too. With
        record="summary" the measures still use all instants, but only the final states are stored,
        which suits many thousands of starts.

    Returns
    -------
    Comparison
        The runs and measures of all schemes; `print` shows a table.

    Raises
    ------
    InputError, GoalError
        If a scheme cannot be simulated; the message names the scheme. All schemes are checked
        before the first simulation.
    Interrupted
        After Ctrl-C; its `run` is the Comparison of the finished schemes.

    Examples
    --------
    >>> from robsim import IBVS, PBVS, load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("camera_retreat")).with_(dt=0.02, duration=15)
    >>> goal = one.task.goal
    >>> result = compare({"image": one.with_(task=IBVS(goal)), "pose": one.with_(task=PBVS(goal))})
    >>> result.data.retreat.round(2).values
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
    """Return the scheme of an experiment or of a recorded run."""
    if not isinstance(one, xr.Dataset):
        return Scheme(name, one, how)
    with prefix_errors(f"scheme '{name}'"):
        if not is_log_run(one):
            raise InputError("expected a recorded run; give Experiment.of(run) for a simulated run")
        return Scheme(name, Experiment.of(one), how, one)


def _make_experiments(
    scene: Scene | Mapping[str, Any], tasks: Any, q0: Any, settings: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return the experiment of each name; InputError names the scheme."""
    if isinstance(scene, Mapping):
        if tasks is not None or q0 is not None or settings:
            raise InputError("experiments have their own tasks, starts and settings: give none")
        return _check_name_mapping(scene, "experiments by name, as in {'mine': experiment}")
    setting_names = [each.name for each in fields(Experiment) if each.name not in _OWN_FIELDS]
    for key in settings:
        if key not in setting_names:
            raise InputError(f"no setting {key!r}; {suggest_names(key, setting_names, 'settings')}")
    scene = check_instance(scene, Scene, "scene")
    start = None if q0 is None else check_starts(scene, q0, "q0")
    experiments = {}
    for name, task in _check_name_mapping(tasks, "tasks by name, as in {'mine': IBVS()}").items():
        with prefix_errors(f"scheme '{name}'"):
            experiments[name] = Experiment(scene, task, start, **settings)
    return experiments


# fields of `Experiment` that are no settings
_OWN_FIELDS = ("scene", "task", "start", "varied", "source", "title")


def _check_name_mapping(value: Any, expected: str) -> Mapping[str, Any]:
    """Return schemes by name; raise InputError if `value` is no mapping of names."""
    if not isinstance(value, Mapping) or not value:
        raise InputError(f"expected {expected}, got {format_value(value)}")
    for name in value:
        if not isinstance(name, str) or not name:
            raise InputError(f"expected a text as the name of a scheme, got {format_value(name)}")
    return value


def _check_schemes(schemes: Sequence[Scheme]) -> None:
    """Raise InputError if a scheme cannot be compared, or the numbers of starts differ."""
    for scheme in schemes:
        one = check_instance(scheme.experiment, Experiment, f"scheme '{scheme.name}'")
        if isinstance(one.task, SelfSimulatingTask):
            raise InputError(
                f"scheme '{scheme.name}': a mission has no single error and is not compared; "
                "compare tasks of its phases"
            )
        if one.varied:
            raise InputError(
                f"scheme '{scheme.name}': its scene or task differs from run to run; compare "
                "the runs of `of_run(i)`"
            )
        scheme.check()
    batches = {scheme.start.shape[:-1] for scheme in schemes}
    if len(batches) > 1:
        raise InputError(f"q0: every scheme needs the same number of starts, got {batches}")


def _assemble_comparison(
    schemes: Sequence[Scheme], results: Sequence[tuple[xr.Dataset, MeasureArrays]]
) -> Comparison:
    """Return the comparison of the finished schemes from the run and the measures of each."""
    finished, runs = schemes[: len(results)], [run for run, _ in results]
    first = runs[0]
    dims = ("scheme", *(("run",) if "run" in first.dims else ()))
    shape = (len(finished), *(first.sizes[dim] for dim in dims[1:]))
    data = {
        key: (
            dims,
            np.stack([values[key] for _, values in results]).reshape(shape),
            {"units": each.unit, "long_name": each.meaning},
        )
        for key, each in MEASURES.items()
    }
    began = np.stack(
        [is_valid_start(run["outcome"].values, run["end_time"].values) for run in runs]
    )
    ending = {
        "outcome": (
            dims,
            np.stack([run["outcome"].values for run in runs]),
            first["outcome"].attrs,
        ),
        "began": (dims, began, {"units": "1", "long_name": "whether the start could begin"}),
    }
    names = [scheme.name for scheme in finished]
    coordinates = {"scheme": names, **{dim: first[dim].values for dim in dims[1:]}}
    attributes = {"title": "RobSim comparison", "robsim": first.attrs["robsim"]}
    return Comparison(
        dict(zip(names, runs, strict=True)),
        xr.Dataset({**ending, **data}, coordinates, attributes),
        {scheme.name: scheme.experiment.scene for scheme in finished},
        tuple(_describe_differences(finished)),
    )


def _describe_differences(schemes: Sequence[Scheme]) -> Iterable[str]:
    """Yield a note for each difference between the schemes other than the task."""
    first, *others = schemes
    one = first.experiment
    differ = {
        "another scene": [x.name for x in others if x.experiment.scene != one.scene],
        "another start": [x.name for x in others if not np.array_equal(x.start, first.start)],
        "other run settings": [
            x.name for x in others if _shared_settings(x) != _shared_settings(first)
        ],
    }
    for difference, names in differ.items():
        if names:
            yield f"note: {difference} than {first.name}: {', '.join(names)}"


def _shared_settings(scheme: Scheme) -> dict[str, Any]:
    """Return the settings of a scheme without its title."""
    return {**scheme.experiment.settings, "title": None}
