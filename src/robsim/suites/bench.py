"""`bench`: simulate schemes on suites, and count their successes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from robsim.analysis.compared_scheme import run_steps
from robsim.base.arrays import as_bool, has_items
from robsim.base.errors import InputError, format_value
from robsim.engine.workers import Progress, check_progress
from robsim.servo.tasks.task import Task
from robsim.suites.benchmark import Benchmark, assemble_benchmark
from robsim.suites.builtin_schemes import check_user_schemes, make_task
from robsim.suites.reproduction import Reproduction, run_reproduction
from robsim.suites.suite import Suite
from robsim.suites.suite_registry import load_quick_suites, load_suite
from robsim.suites.suite_trial import Trial

if TYPE_CHECKING:
    import pandas as pd


def bench(
    suites: str | Suite | Reproduction | Sequence[str | Suite | Reproduction] | None = None,
    schemes: Mapping[str, Task | Callable[..., Task]] | None = None,
    *,
    builtin: bool = True,
    progress: Progress | None = None,
    threads: int | None = None,
    chunk: int = 256,
) -> Benchmark:
    """Compare schemes on suites of starts, and return the success rates with intervals.

    Parameters
    ----------
    suites : str, Suite, or sequence of these, optional
        Names of suites, or user-defined suites. Default: all suites of RobSim without
        pictures; "photometric" and "vit_500_images" take minutes. The suite "gallery", which
        reproduces published numbers, has schemes of its own.
    schemes : mapping of str to Task or callable, optional
        User schemes by name. A scheme is a task, which receives the goal and the gain of the suite,
        or a class or function that returns a task, as in scheme(goal, gain=2.0).
    builtin : bool, default True
        Whether to include the schemes of the suite, mostly textbook schemes.
    progress : callable, optional
        Function that is called with the finished share, 0 to 1.
    threads : int, optional
        Number of threads. Default: one for each processor.
    chunk : int, default 256
        Number of runs that are simulated in lockstep.

    Returns
    -------
    Benchmark
        The counted runs; `print` shows a table for each suite.

    Raises
    ------
    InputError
        If an argument is invalid, which is checked before the first simulation, or if a scheme
        raises an error in a run.
    Interrupted
        After Ctrl-C; its `run` is the Benchmark of the finished runs.

    Examples
    --------
    >>> from robsim import IBVS
    >>> result = bench("vit_500", {"twice the depth": IBVS(depth_scale=2.0)}, builtin=False)
    >>> int(result.data["success"].sum())
    391
    """
    check_progress(progress)
    chosen = _select_suites(suites)
    own = check_user_schemes({} if schemes is None else schemes)
    if not as_bool(builtin, "builtin") and not own:
        raise InputError("no scheme to compare: give schemes, or builtin=True")
    how = {"threads": threads, "chunk": chunk}
    steps = [step for suite in chosen for step in _make_steps(suite, own, builtin, how)]
    return run_steps(steps, partial(assemble_benchmark, chosen), progress)


def _select_suites(suites: Any) -> list[Suite | Reproduction]:
    """Return the suites, loaded by name if necessary; raise InputError for other values."""
    listed = load_quick_suites() if suites is None else suites
    if isinstance(listed, str | Suite | Reproduction):
        listed = [listed]
    listed = tuple(listed) if has_items(listed) else ()
    if not listed:
        raise InputError(f"expected names of suites, got {format_value(suites)}")
    loaded = [
        each if isinstance(each, Suite | Reproduction) else load_suite(each) for each in listed
    ]
    names_of_suites = [each.name for each in loaded]
    if len(set(names_of_suites)) < len(names_of_suites):
        raise InputError(f"suites: a suite occurs twice in {', '.join(names_of_suites)}")
    return loaded


def _make_steps(
    suite: Suite | Reproduction, own: Mapping[str, Any], builtin: bool, how: Mapping[str, Any]
) -> list[Callable[[Progress | None], pd.DataFrame]]:
    """Check the schemes of a suite, and return a function for each scheme that returns its rows."""
    if isinstance(suite, Reproduction):
        return [partial(run_reproduction, suite, how)]  # checked by the tests of RobSim
    goal, gain = suite.task_goal, suite.gain
    every = {**(suite.schemes if builtin else {}), **own}
    tasks = {name: make_task(name, scheme, goal, gain) for name, scheme in every.items()}
    trials = [Trial(suite, name, task, how) for name, task in tasks.items()]
    for trial in trials:
        trial.check()
    return [trial.rows for trial in trials]
