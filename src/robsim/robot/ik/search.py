"""The searches of inverse kinematics for many runs: compiled, in chunks, on threads."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels import ik as kernels
from robsim.kernels import ik_step
from robsim.kernels.jacobian import spread
from robsim.robot.ik.arm import Arm
from robsim.robot.ik.effort import Effort

CHUNK = 16384  # runs that one thread takes at a time


def search(
    arm: Arm, target: ik_step.Target, goals: Array, q0: Array, effort: Effort
) -> kernels.Found:
    """Return the results of a search for goals[run, 4, 4] from q0[run, nq]."""
    starts, runs = arm.starts(effort.restarts, effort.seed), len(goals)
    counts = np.empty((3, runs), dtype=np.int64)
    found = kernels.Found(np.empty(q0.shape), np.empty(runs), *counts)
    solve = _compiled if arm.tree.compiled else _in_python

    def job(start: int, end: int) -> None:
        given, out = (goals, q0), found
        if end - start < runs:
            given = goals[start:end], q0[start:end]
            out = kernels.Found(*(array[start:end] for array in found))
        solve(arm, target, *given, starts, effort, out)

    _in_chunks(job, runs, effort.threads)
    return found


def _compiled(
    arm: Arm,
    target: ik_step.Target,
    goals: Array,
    q0: Array,
    starts: tuple[Array, Array],
    effort: Effort,
    found: kernels.Found,
) -> None:
    """Fill `found` by one kernel, whose arguments are what is in all these tuples."""
    body, offset, moves, *counted = target
    kernels.solve(
        *arm.tree.packed,
        body,
        offset,
        *moves,
        *counted,
        *arm.bounds,
        goals,
        q0,
        *starts,
        effort.tolerance,
        effort.iterations,
        *found,
    )


def _in_python(
    arm: Arm,
    target: ik_step.Target,
    goals: Array,
    q0: Array,
    starts: tuple[Array, Array],
    effort: Effort,
    found: kernels.Found,
) -> None:
    """Fill `found` as the kernel does, for trees with joints of the user's own kinds."""
    tree, begun = arm.tree, kernels.Starts(q0, *starts)
    lanes, model, v = kernels.begin(tree.joints, target, goals, begun, found)
    queue, pace = np.full(2, lanes.run.size), (effort.tolerance, effort.iterations)
    while queue[1] > 0:
        tree.prepare(lanes.q, model.bodies)
        ik_step.propose(tree.joints, target, arm.bounds, lanes, model)
        kernels.decide(target, arm.bounds, goals, begun, *pace, lanes, model, found, queue)
        spread(target.moves.columns, model.step, target.rest, v)
        tree.flow(lanes.q, v, 1.0)
        ik_step.confine(arm.bounds, lanes.q)


def _in_chunks(job: Callable[[int, int], None], runs: int, threads: int) -> None:
    """Call job(start, end) over all runs, on threads if there are many."""
    chunk = min(CHUNK, max(kernels.LANES, math.ceil(runs / threads)))
    ends = [(i, min(i + chunk, runs)) for i in range(0, max(runs, 1), chunk)]
    if threads == 1 or len(ends) == 1:
        for start, end in ends:
            job(start, end)
        return
    with ThreadPoolExecutor(min(threads, len(ends))) as pool:
        try:
            list(pool.map(job, *zip(*ends, strict=True)))  # the first error is raised here
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C the others need not begin
