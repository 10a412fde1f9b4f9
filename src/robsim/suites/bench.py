"""`bench`: simulate schemes on suites, and count how often each succeeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from robsim.analysis.compared_scheme import run_steps
from robsim.base.arrays import as_bool, has_items
from robsim.base.errors import InputError, format_value
from robsim.engine.workers import Progress, check_progress
from robsim.suites.benchmark import Benchmark, assemble_benchmark
from robsim.suites.builtin_schemes import check_user_schemes, make_task
from robsim.suites.reproduction import Reproduction, run_reproduction
from robsim.suites.suite import Suite
from robsim.suites.suite_registry import list_suites, load_suite
from robsim.suites.suite_trial import Trial


def bench(
    suites: str | Suite | Reproduction | Sequence[str | Suite | Reproduction] | None = None,
    schemes: Mapping[str, Any] | None = None,
    *,
    builtin: bool = True,
    progress: Progress | None = None,
    threads: int | None = None,
    chunk: int = 256,
) -> Benchmark:
    """Compare schemes on suites of starts, and return the shares that succeed, with intervals.

    suites    names of suites, or suites of your own (`Suite`); None: all that ship with RobSim
    schemes   your own, {name: scheme}: a task, which gets the goal and the gain of the suite, or
              a class or function that is called as scheme(goal, gain=2.0) and returns a task
    builtin   compare with the schemes of the suite, which are mostly those of the textbooks

    `progress`, `threads` and `chunk` are as in `simulate`. A suite that repeats published numbers,
    "gallery", has schemes of its own.

    InputError before anything runs, and where a scheme raises something within a run; Interrupted
    after Ctrl-C, whose `run` is the Benchmark of what was simulated so far.

    >>> from robsim import IBVS
    >>> found = bench("vit_500", {"twice the depth": IBVS(depth_scale=2.0)}, builtin=False)
    >>> int(found.data["success"].sum())
    391
    """
    check_progress(progress)
    chosen = _select_suites(suites)
    own = check_user_schemes({} if schemes is None else schemes)
    if not as_bool(builtin, "builtin") and not own:
        raise InputError("no scheme to compare: give some, or builtin=True")
    how = {"threads": threads, "chunk": chunk}
    steps = [step for suite in chosen for step in _make_steps(suite, own, builtin, how)]
    return run_steps(steps, partial(assemble_benchmark, chosen), progress)


def _select_suites(suites: Any) -> list[Any]:
    """Return suites by name or as they are; InputError for what is none."""
    listed = list_suites() if suites is None else suites
    if isinstance(listed, str | Suite | Reproduction):
        listed = [listed]
    listed = tuple(listed) if has_items(listed) else ()
    if not listed:
        raise InputError(f"expected names of suites, got {format_value(suites)}")
    found = [
        each if isinstance(each, Suite | Reproduction) else load_suite(each) for each in listed
    ]
    called = [each.name for each in found]
    if len(set(called)) < len(called):
        raise InputError(f"suites: each once, got {', '.join(called)}")
    return found


def _make_steps(
    suite: Any, own: Mapping[str, Any], builtin: bool, how: Mapping[str, Any]
) -> list[Any]:
    """Return what makes the rows of each scheme in a suite, once it is known that it can."""
    if isinstance(suite, Reproduction):
        return [partial(run_reproduction, suite, how)]  # what ships is checked by tests
    goal, gain = suite.task_goal, suite.gain
    every = {**(suite.schemes if builtin else {}), **own}
    made = {name: make_task(name, scheme, goal, gain) for name, scheme in every.items()}
    trials = [Trial(suite, name, task, how) for name, task in made.items()]
    for trial in trials:
        trial.check()
    return [trial.rows for trial in trials]
