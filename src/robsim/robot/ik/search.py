"""The searches of inverse kinematics for many runs: compiled, in chunks, on threads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels import ik as kernels
from robsim.kernels import ik_step
from robsim.kernels.jacobian import spread
from robsim.robot.tree import Tree

CHUNK = 16384  # runs that one thread takes at a time


def search(
    tree: Tree,
    target: ik_step.Target,
    bounds: ik_step.Bounds,
    goals: Array,
    q0: Array,
    starts: tuple[Array, Array],
    tolerance: float,
    iterations: int,
) -> kernels.Found:
    """Return the results for goals[3, 4, run], searched from q0[nq, run] and from the starts."""
    runs = goals.shape[-1]
    counts = (np.full(runs, value) for value in (kernels.ITERATIONS, 0, 0))
    found = kernels.Found(q0.copy(), np.full(runs, np.inf), *counts)  # inf and NaN stay as they are
    given = goals, kernels.Starts(q0, *starts), tolerance, iterations
    if tree.compiled:
        kernels.solve(tree.joints, target, bounds, *given, found)
    else:
        _in_python(tree, target, bounds, *given, found)
    return found


def _in_python(
    tree: Tree,
    target: ik_step.Target,
    bounds: ik_step.Bounds,
    goals: Array,
    starts: kernels.Starts,
    tolerance: float,
    iterations: int,
    found: kernels.Found,
) -> None:
    """Return the results of `kernels.solve` for trees with joints of the user's own kinds."""
    lanes, model, v = kernels.begin(tree.joints, target, goals, starts, found)
    queue = np.full(2, lanes.run.size)
    while queue[1] > 0:
        tree.prepare(lanes.q, model.bodies)
        ik_step.propose(tree.joints, target, bounds, lanes, model)
        kernels.decide(
            target, bounds, goals, starts, tolerance, iterations, lanes, model, found, queue
        )
        spread(target.moves.columns, model.step, target.rest, v)
        tree.flow(lanes.q, v, 1.0)
        ik_step.confine(bounds, lanes.q)


def in_chunks(job: Any, runs: int, threads: int) -> kernels.Found:
    """Call job(start, end) over all runs, on threads if there are many."""
    chunk = min(CHUNK, max(kernels.LANES, math.ceil(runs / threads)))
    ends = [(i, min(i + chunk, runs)) for i in range(0, max(runs, 1), chunk)]
    if threads == 1 or len(ends) == 1:
        return _joined([job(*end) for end in ends])
    with ThreadPoolExecutor(min(threads, len(ends))) as pool:
        try:
            return _joined(list(pool.map(job, *zip(*ends, strict=True))))
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C the others need not begin


def _joined(parts: Sequence[kernels.Found]) -> kernels.Found:
    return kernels.Found(*(np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True)))
