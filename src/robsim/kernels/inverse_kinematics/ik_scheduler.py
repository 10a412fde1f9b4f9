"""Inverse kinematics by searches from several starts, for many runs in parallel.

The runs of a batch pass through the lanes of one block. When a run is done, the next run takes its
lane. The computation in a lane depends on its own run only, and so do the bits of the result.
"""

from typing import Any, NamedTuple

import numpy as np

from robsim.kernels.inverse_kinematics.ik_actions import (
    ACTION,
    BEST,
    BOOST,
    DONE,
    ERROR,
    GOAL,
    HELD,
    ITERATION,
    MOST_ITERATIONS,
    OVER,
    PREDICTED_GAIN,
    REFERENCE,
    RESTARTS,
    RUN,
    SEARCH,
    START_DISTANCE,
    STEP,
    STILL,
    STORES_RESULT,
    TOLERANCE,
    Q,
)
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, put
from robsim.kernels.machine.stages import perform_on_block

SOLVED, UNREACHABLE, LIMITS, ITERATIONS = 1, 2, 3, 4
REASON, ITERATED, RESTARTED = 0, 1, 2  # rows of `counts`


class Search(NamedTuple):
    """The goals of the runs, and the starts of their searches."""

    goals: Any  # (run, 4, 4)
    q0: Any  # (run, nq), the first start of each run
    q: Any  # (nq, k), the further starts
    poses: Any  # (k, 12) poses of the link at the further starts, [R | t] row by row
    share: Any  # (12,) weights of squared pose differences in the distance of a start
    rows: Any  # indices of the coordinates that take values of further starts
    tolerance: float
    iterations: int  # most iterations of a search


class SearchResults(NamedTuple):
    """The best results of the searches so far."""

    q: Any  # (run, nq)
    error: Any  # (run,) the larger error of position in metres and rotation in radians
    counts: Any  # (3, run) reason of the end, iterations, restarts


def initial_results(q0: Any) -> SearchResults:
    """Return the results before the searches start at q0[run, nq]."""
    counts = np.zeros((3, len(q0)), dtype=np.int64)
    counts[REASON] = ITERATIONS
    return SearchResults(q0.copy(), np.full(len(q0), np.inf), counts)


@entry(
    "out float64[::1], Search(float64[:, :, ::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[::1], int64[::1], float64, int64)",
    inline="always",
)
def begin_searches(block, search):
    """Initialise all lanes for their first runs."""
    for i in range(search.q0.shape[1] if search.q0.shape[0] > 0 else 0):
        put(block, Q + i, search.q0[0, i])
    put(block, ACTION, DONE)
    put(block, RUN, -1.0)
    put(block, TOLERANCE, search.tolerance)
    put(block, MOST_ITERATIONS, search.iterations)
    put(block, RESTARTS, search.q.shape[1])


@part
def _enter_run(block, b, run, goals):
    """Start the search of a run in lane b of a block."""
    for row in (SEARCH, ITERATION, REFERENCE, PREDICTED_GAIN):
        block[row * WIDTH + b] = 0.0
    block[RUN * WIDTH + b], block[BOOST * WIDTH + b] = run, 1.0
    block[START_DISTANCE * WIDTH + b], block[BEST * WIDTH + b] = -1.0, np.inf
    for r in range(3):
        for c in range(4):
            block[(GOAL + 4 * r + c) * WIDTH + b] = goals[run, r, c]


@part
def _store_result(block, b, run, results):
    """Store the state of lane b as the best result of its run."""
    results.error[run] = block[ERROR * WIDTH + b]
    for i in range(results.q.shape[1]):
        results.q[run, i] = block[(Q + i) * WIDTH + b]
    reason = ITERATIONS
    if results.error[run] < block[TOLERANCE * WIDTH + b]:
        reason = SOLVED
    elif block[STILL * WIDTH + b] > 0.0:
        reason = LIMITS if block[HELD * WIDTH + b] > 0.0 else UNREACHABLE
    results.counts[REASON, run] = reason


@part
def _nearest_start(block, b, search):
    """Return the index of the unused start with the pose nearest to the goal.

    The squared distance of rotations is |R - R_goal|^2/2 = 2 - 2 cos.
    """
    last_distance, nearest, chosen = block[START_DISTANCE * WIDTH + b], np.inf, 0
    for k in range(search.q.shape[1]):
        square = 0.0
        for i in range(12):
            difference = block[(GOAL + i) * WIDTH + b] - search.poses[k, i]
            square += search.share[i] * difference * difference
        if last_distance < square < nearest:
            nearest, chosen = square, k
    block[START_DISTANCE * WIDTH + b] = nearest
    return chosen


@part
def _restart_search(block, b, run, search, results):
    """Start another search. After all starts the last search continues from the best result."""
    block[SEARCH * WIDTH + b] += 1.0
    block[ITERATION * WIDTH + b] = 0.0
    if block[SEARCH * WIDTH + b] > search.q.shape[1]:
        block[BEST * WIDTH + b] = np.inf
        return
    results.counts[RESTARTED, run] += 1
    chosen = _nearest_start(block, b, search)
    for i in range(search.q0.shape[1]):
        block[(Q + i) * WIDTH + b] = search.q0[run, i]
    for i in search.rows:
        block[(Q + i) * WIDTH + b] = search.q[i, chosen]


@entry(
    "out float64[::1], int64, Search(float64[:, :, ::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[::1], int64[::1], float64, int64), "
    "out SearchResults(float64[:, ::1], float64[::1], int64[:, ::1]) -> int64, int64",
    inline="always",
)
def schedule_lanes(block, after, search, results):
    """Store results, then start the next run, the next search, or restore the best coordinates.

    Return the index of the next run and the number of busy lanes.
    """
    going = 0
    for b in range(WIDTH):
        run, turn = int(block[RUN * WIDTH + b]), block[ACTION * WIDTH + b]
        if block[STORES_RESULT * WIDTH + b] > 0.0:
            _store_result(block, b, run, results)
        if run >= 0 and turn >= OVER:
            results.counts[ITERATED, run] += int(block[ITERATION * WIDTH + b])
        if turn == DONE:
            run = after if after < results.error.size else -1
            block[RUN * WIDTH + b] = run
            if run >= 0:
                _enter_run(block, b, run, search.goals)
                after += 1
        if run >= 0 and turn > STEP:
            for i in range(results.q.shape[1]):
                block[(Q + i) * WIDTH + b] = results.q[run, i]
        if turn == OVER:
            _restart_search(block, b, run, search, results)
        going += 1 if run >= 0 else 0
    return after, going


@entry(
    "int64[::1], int64[::1], int64[::1], float64[::1], float64[:, :, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[:, ::1], float64[::1], int64[::1], float64, int64, "
    "out float64[:, ::1], out float64[::1], out int64[:, ::1]"
)
def run_searches(
    addresses,
    at,
    p,
    template,
    goals,
    q0,
    starts,
    poses,
    share,
    rows,
    tolerance,
    iterations,
    q,
    error,
    counts,
):
    """Search coordinates that move a link to goals[run, 4, 4] within the tolerance.

    The first search starts at q0, and each further search at the start with the pose nearest to the
    goal. The arguments are the stages of one iteration, then the fields of a `Search` and of a
    `SearchResults`.
    """
    search = Search(goals, q0, starts, poses, share, rows, tolerance, iterations)
    results, block = SearchResults(q, error, counts), template.copy()
    begin_searches(block, search)
    after, going = 0, 1
    while going > 0:
        after, going = schedule_lanes(block, after, search, results)
        if going > 0:
            perform_on_block(addresses, at, p, block, 0)
