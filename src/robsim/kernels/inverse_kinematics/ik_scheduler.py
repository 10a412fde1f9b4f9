"""Inverse kinematics: searches from several starts, for many runs side by side.

The runs of a batch pass through the lanes of one block; where one is done, the next takes its
lane. What happens in a lane depends on its own run alone, so its bits do too.
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
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH, put
from robsim.kernels.machine.stages import perform_on_block

SOLVED, UNREACHABLE, LIMITS, ITERATIONS = 1, 2, 3, 4
REASON, ITERATED, RESTARTED = 0, 1, 2  # rows of what is counted


class Search(NamedTuple):
    """The runs, and where their searches begin."""

    goals: Any  # (run, 4, 4)
    q0: Any  # (run, nq), the first start
    q: Any  # (nq, k), the others
    poses: Any  # (k, 12) of the link there, [R | t] row by row
    share: Any  # (12,) of the squared differences of poses in the distance of a start
    rows: Any  # of the coordinates that begin elsewhere
    tolerance: float
    iterations: int  # of a search, at most


class SearchResults(NamedTuple):
    """The results of searches, with the run first: the best until now, at first `initial_results`."""

    q: Any  # (run, nq)
    error: Any  # the larger of the metres and the radians that count
    counts: Any  # (3, run) the reason, iterations, restarts


def initial_results(q0: Any) -> SearchResults:
    """Return what is found before the searches begin at q0[run, nq]."""
    counts = np.zeros((3, len(q0)), dtype=np.int64)
    counts[REASON] = ITERATIONS
    return SearchResults(q0.copy(), np.full(len(q0), np.inf), counts)


@part
def begin_searches(block, search):
    """Make all lanes ready for their first runs, at the first start."""
    for i in range(search.q0.shape[1] if search.q0.shape[0] > 0 else 0):
        put(block, Q + i, search.q0[0, i])
    put(block, ACTION, DONE)
    put(block, RUN, -1.0)
    put(block, TOLERANCE, search.tolerance)
    put(block, MOST_ITERATIONS, search.iterations)
    put(block, RESTARTS, search.q.shape[1])


@part
def _enter_run(block, b, run, goals):
    """Let the search of a run begin in a lane of a block."""
    for row in (SEARCH, ITERATION, REFERENCE, PREDICTED_GAIN):
        block[row * WIDTH + b] = 0.0
    block[RUN * WIDTH + b], block[BOOST * WIDTH + b] = run, 1.0
    block[START_DISTANCE * WIDTH + b], block[BEST * WIDTH + b] = -1.0, np.inf
    for r in range(3):
        for c in range(4):
            block[(GOAL + 4 * r + c) * WIDTH + b] = goals[run, r, c]


@part
def _store_result(block, b, run, found):
    """Store a result that is the best of its run."""
    found.error[run] = block[ERROR * WIDTH + b]
    for i in range(found.q.shape[1]):
        found.q[run, i] = block[(Q + i) * WIDTH + b]
    reason = ITERATIONS
    if found.error[run] < block[TOLERANCE * WIDTH + b]:
        reason = SOLVED
    elif block[STILL * WIDTH + b] > 0.0:
        reason = LIMITS if block[HELD * WIDTH + b] > 0.0 else UNREACHABLE
    found.counts[REASON, run] = reason


@part
def _nearest_start(block, b, search):
    """Return the unused start whose pose is nearest to the goal.

    The rotation counts |R - R_goal|^2/2 = 2 - 2 cos.
    """
    begun, nearest, chosen = block[START_DISTANCE * WIDTH + b], np.inf, 0
    for k in range(search.q.shape[1]):
        square = 0.0
        for i in range(12):
            away = block[(GOAL + i) * WIDTH + b] - search.poses[k, i]
            square += search.share[i] * away * away
        if begun < square < nearest:
            nearest, chosen = square, k
    block[START_DISTANCE * WIDTH + b] = nearest
    return chosen


@part
def _restart_search(block, b, run, search, found):
    """Begin another search; after all starts the last one goes on from the best that was found."""
    block[SEARCH * WIDTH + b] += 1.0
    block[ITERATION * WIDTH + b] = 0.0
    if block[SEARCH * WIDTH + b] > search.q.shape[1]:
        block[BEST * WIDTH + b] = np.inf
        return
    found.counts[RESTARTED, run] += 1
    chosen = _nearest_start(block, b, search)
    for i in range(search.q0.shape[1]):
        block[(Q + i) * WIDTH + b] = search.q0[run, i]
    for i in search.rows:
        block[(Q + i) * WIDTH + b] = search.q[i, chosen]


@part
def schedule_lanes(block, after, search, found):
    """Book what was found, and begin anew, go back, or take another run where that comes next.

    Return the number of the next run, and how many lanes go on.
    """
    going = 0
    for b in range(WIDTH):
        run, turn = int(block[RUN * WIDTH + b]), block[ACTION * WIDTH + b]
        if block[STORES_RESULT * WIDTH + b] > 0.0:
            _store_result(block, b, run, found)
        if run >= 0 and turn >= OVER:
            found.counts[ITERATED, run] += int(block[ITERATION * WIDTH + b])
        if turn == DONE:
            run = after if after < found.error.size else -1
            block[RUN * WIDTH + b] = run
            if run >= 0:
                _enter_run(block, b, run, search.goals)
                after += 1
        if run >= 0 and turn > STEP:
            for i in range(found.q.shape[1]):
                block[(Q + i) * WIDTH + b] = found.q[run, i]
        if turn == OVER:
            _restart_search(block, b, run, search, found)
        going += 1 if run >= 0 else 0
    return after, going


@kernel
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
    """Search coordinates that bring a link to goals[run, 4, 4], to within the tolerance.

    The first search begins at q0, each further one at the start whose pose is nearest the goal.
    The arguments are stages that take a step and propose the next, and a Search and a Found.
    """
    search = Search(goals, q0, starts, poses, share, rows, tolerance, iterations)
    found, block = SearchResults(q, error, counts), template.copy()
    begin_searches(block, search)
    after, going = 0, 1
    while going > 0:
        after, going = schedule_lanes(block, after, search, found)
        if going > 0:
            perform_on_block(addresses, at, p, block, 0)
