"""`compare`: simulate several tasks from the same start and measure them alike."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.analysis.comparison import Comparison
from robsim.analysis.measures import MEASURES
from robsim.analysis.scheme import Measures, Scheme, run_and_measure, share_of
from robsim.base.errors import InputError, Interrupted, suggest
from robsim.run.outcome import Outcome
from robsim.run.simulate import Progress, check_progress, simulate
from robsim.servo import Task
from robsim.world.scene import Scene

_OURS = {"scene", "task", "q0", "progress"}  # keywords of simulate that are not settings
NO_START = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA, Outcome.JOINT_LIMIT)  # if at time 0


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
    settings    keywords of `simulate`, the same for all, and so are seed and run numbers; with
                record="summary" all instants are measured and the ends alone are kept, for many
                thousands of starts

    The measures are those of Gans, Hutchinson and Corke 2003 in spirit: see
    `robsim.analysis.measures`. Of a batch the table has the share that converged and medians.
    InputError or GoalError names the scheme, before anything runs; Interrupted after Ctrl-C, whose
    `run` is the Comparison of what was simulated so far.

    >>> from robsim import IBVS, PBVS, load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("camera_retreat"))
    >>> goal = one.task.goal
    >>> tasks = {"image": IBVS(goal), "pose": PBVS(goal)}
    >>> found = compare(one.scene, tasks, one.start, dt=0.02, duration=15)
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
    found: dict[str, Measures] = {}
    for i, scheme in enumerate(schemes):
        share_progress, name = share_of(progress, i / len(schemes), 1 / len(schemes)), scheme.name
        try:
            runs[name], found[name] = run_and_measure(scheme, share_progress)
        except Interrupted as stop:
            runs[name], found[name] = stop.run
            message = "stopped by the user; what was simulated so far is in .run"
            raise Interrupted(message, _comparison(schemes, runs, found)) from None
    return _comparison(schemes, runs, found)


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
        scheme.check()
    batches = {scheme.start.shape[:-1] for scheme in schemes}
    if len(batches) > 1:
        raise InputError(f"q0: every scheme needs as many starts as the others, got {batches}")


def _comparison(
    schemes: Sequence[Scheme], runs: dict[str, xr.Dataset], found: dict[str, Measures]
) -> Comparison:
    """Return the comparison of the schemes that were run."""
    done = [scheme for scheme in schemes if scheme.name in runs]
    first = runs[done[0].name]
    dims = ("scheme", *(("run",) if "run" in first.dims else ()))
    shape = (len(done), *(first.sizes[dim] for dim in dims[1:]))
    values = [found[scheme.name] for scheme in done]
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


def _began(run: xr.Dataset) -> NDArray[np.bool_]:
    """Return whether each start, () or (B,), was in sight and within the joint limits."""
    at_once = run["end_time"].values == 0.0
    return np.asarray(~(at_once & np.isin(run["outcome"].values, NO_START)))


def _attributes(key: str) -> dict[str, str]:
    return {"units": MEASURES[key].unit, "long_name": MEASURES[key].meaning}


def _differences(schemes: Sequence[Scheme]) -> Iterable[str]:
    """Yield a note for everything but the task that differs between schemes."""
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
