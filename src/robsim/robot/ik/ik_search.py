"""Numerical inverse kinematics of many poses: compiled searches in chunks, on threads."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, as_integer, as_positive
from robsim.base.errors import InputError
from robsim.base.processors import count_processors
from robsim.kernels.inverse_kinematics import ik_scheduler as kernels
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Blocks
from robsim.robot.ik.descent import IKDescent

LARGEST_CHUNK = 16384  # largest number of runs that one thread takes at a time
SMALLEST_CHUNK = 64  # smallest number of runs that justifies another thread
SMALLEST_TOLERANCE = 1e-12  # metres or radians: smaller errors are rounding


class SearchBudget(NamedTuple):
    """Accuracy of a search, and limits of its work."""

    tolerance: float
    iterations: int
    restarts: int
    seed: int
    threads: int

    @classmethod
    def checked(
        cls, tolerance: Any, iterations: Any, restarts: Any, seed: Any, threads: Any
    ) -> SearchBudget:
        """Return checked settings; raise InputError for values that cannot be used."""
        finest = as_positive(tolerance, "tolerance (metres and radians)")
        if finest < SMALLEST_TOLERANCE:
            raise InputError(
                f"tolerance must be at least {SMALLEST_TOLERANCE:g}, got {tolerance!r}"
            )
        return cls(
            finest,
            as_integer(iterations, "iterations", 1, 10**6),
            as_integer(restarts, "restarts", 0, 10**5),
            as_integer(seed, "seed", 0, 2**64),
            as_integer(count_processors() if threads is None else threads, "threads", 1, 1025),
        )


def search_coordinates(
    descent: IKDescent, goals: Array, q0: Array, effort: SearchBudget
) -> kernels.SearchResults:
    """Return the results of a search for goals[run, 4, 4] from q0[run, nq]."""
    starts, runs = descent.arm.starts(effort.restarts, effort.seed), len(goals)
    results = kernels.initial_results(q0)
    settings = *starts, descent.share, descent.rows, effort.tolerance, effort.iterations
    solve = _search_compiled if descent.tree.compiled else _search_in_python

    def job(start: int, end: int) -> None:
        if end - start == runs:
            solve(descent, kernels.Search(goals, q0, *settings), results)
            return
        q, error, counts = results
        part = kernels.SearchResults(q[start:end], error[start:end], counts[:, start:end].copy())
        solve(descent, kernels.Search(goals[start:end], q0[start:end], *settings), part)
        counts[:, start:end] = part.counts

    _run_in_chunks(job, runs, effort.threads)
    return results


def _search_compiled(
    descent: IKDescent, problem: kernels.Search, results: kernels.SearchResults
) -> None:
    """Fill the results by one kernel, with the members of these tuples as arguments."""
    kernels.run_searches(*descent.prepared, *problem, *results)


def _search_in_python(
    descent: IKDescent, problem: kernels.Search, results: kernels.SearchResults
) -> None:
    """Fill the results as the kernel does, for trees with joints of Python kinds."""
    blocks = Blocks(descent.program, np.zeros(WIDTH, dtype=np.int64))
    block, parts = blocks.flat[0], descent.program.segments()
    kernels.begin_searches(block, problem)
    state, active = kernels.schedule_lanes(block, 0, problem, results)
    while active > 0:
        for part in parts:
            part(blocks, 0)
        state, active = kernels.schedule_lanes(block, state, problem, results)


def _run_in_chunks(job: Callable[[int, int], None], runs: int, threads: int) -> None:
    """Call job(start, end) over all runs, on threads if there are many."""
    chunk = min(LARGEST_CHUNK, max(SMALLEST_CHUNK, math.ceil(runs / threads)))
    ends = [(i, min(i + chunk, runs)) for i in range(0, max(runs, 1), chunk)]
    if threads == 1 or len(ends) == 1:
        for start, end in ends:
            job(start, end)
        return
    with ThreadPoolExecutor(min(threads, len(ends))) as pool:
        try:
            list(pool.map(job, *zip(*ends, strict=True)))  # the first error is raised here
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C no further jobs start
