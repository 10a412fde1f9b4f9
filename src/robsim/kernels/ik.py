"""Inverse kinematics: searches from several starts, for many runs side by side.

The runs of a batch pass through a few lanes in lockstep; where one is done, the next takes its
lane. What happens in a lane depends on its own run alone, so its bits do too.
"""

from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import jacobian, tree
from robsim.kernels.ik_step import Bounds, Lanes, Target, confine, propose, room
from robsim.kernels.jit import kernel, part
from robsim.kernels.packed import unpack

SOLVED, UNREACHABLE, LIMITS, ITERATIONS = 1, 2, 3, 4
REST, STEP, BACK, OVER, DONE = 0, 1, 2, 3, 4  # what a lane may do after an iteration
LANES = 64
PERIOD, FALL = 4, 0.5  # a search goes on while e'e falls by this factor in so many iterations
LONGER = 10  # times the iterations of others: the last search, which looks for the least error


class Starts(NamedTuple):
    """The starts of searches, with their poses."""

    q0: Any  # (run, nq), the first
    q: Any  # (nq, k), the others
    poses: Any  # (3, 4, k) of the link there


class Found(NamedTuple):
    """The results of searches, with the run first."""

    q: Any  # (run, nq)
    error: Any  # the larger of the metres and the radians that count
    reason: Any
    iterations: Any
    restarts: Any


@part
def _keep(lanes, b, q):
    for i in range(q.size):
        q[i] = lanes.q[i, b]


@part
def _load(q, lanes, b):
    for i in range(q.size):
        lanes.q[i, b] = q[i]


@kernel
def _search(lanes, model, tolerance, restarts, iterations):
    """Set the next action of each lane; a search ends where it is still, stuck, or too long."""
    for b in range(lanes.run.size):
        it, square, last = lanes.iteration[b], model.square[b], lanes.search[b] > restarts
        stuck = False
        if it % PERIOD == 0 and not last:
            stuck = it > 0 and square > FALL * lanes.mark[b]
            lanes.mark[b] = square
        lanes.iteration[b] = it + 1
        over = stuck or model.still[b] or it >= (LONGER if last else 1) * iterations
        if lanes.run[b] < 0:
            lanes.turn[b] = REST
        elif lanes.error[b] < tolerance or (over and last):
            lanes.turn[b] = DONE
        else:
            lanes.turn[b] = OVER if over else STEP


@kernel
def _book(lanes, model, tolerance, restarts, found):
    """Store the best result where a search ends, and at every iteration of the last one."""
    for b in range(lanes.run.size):
        run, ends = lanes.run[b], lanes.turn[b] == OVER or lanes.turn[b] == DONE
        if ends:
            found.iterations[run] += lanes.iteration[b]
        looks = run >= 0 and (ends or lanes.search[b] > restarts)
        if looks and model.square[b] < lanes.best[b]:
            lanes.best[b], found.error[run] = model.square[b], lanes.error[b]
            _keep(lanes, b, found.q[run])
            if lanes.error[b] < tolerance:
                found.reason[run] = SOLVED
            elif model.still[b]:
                found.reason[run] = LIMITS if model.held[b] > 0 else UNREACHABLE
            else:
                found.reason[run] = ITERATIONS


@kernel
def _descend(lanes, model, restarts):
    """Undo a step of the last search that went uphill, and adapt its damping to the model.

    By the ratio of what was gained to what was promised (K. Madsen, H. B. Nielsen and O. Tingleff,
    Methods for non-linear least squares problems, 2004, section 3.2).
    """
    for b in range(lanes.run.size):
        if lanes.turn[b] == STEP and lanes.search[b] > restarts:
            fell = lanes.mark[b] - model.square[b]
            if lanes.iteration[b] > 1 and fell < 0.25 * lanes.hoped[b]:
                lanes.boost[b] *= 4.0
            elif lanes.iteration[b] > 1 and fell > 0.75 * lanes.hoped[b]:
                lanes.boost[b] = max(1.0, lanes.boost[b] / 3.0)
            if model.square[b] > lanes.best[b]:
                lanes.turn[b] = BACK
            lanes.mark[b], lanes.hoped[b] = lanes.best[b], model.gain[b]


@kernel
def _enter(lanes, b, run, goals, q0):
    """Put a run into a lane."""
    lanes.run[b], lanes.search[b], lanes.iteration[b] = run, 0, 0
    lanes.begun[b], lanes.best[b], lanes.boost[b] = -1.0, np.inf, 1.0
    for r in range(3):
        for c in range(4):
            lanes.goal[r, c, b] = goals[run, r, c]
    _load(q0[run], lanes, b)


@kernel
def _distances(target, goal, b, T, square):
    """Compute square[k] of T[3, 4, k] from goal b, with mean weights.

    The rotation counts |R - R_goal|^2/2 = 2 - 2 cos.
    """
    weight = target.weight
    spin = (weight[3] ** 2 + weight[4] ** 2 + weight[5] ** 2) / 6.0
    for k in range(square.size):
        square[k] = 0.0
    for r in range(3):
        for c in range(2 if target.pointing else 0, 4):
            factor, wanted = weight[r] ** 2 if c == 3 else spin, goal[r, c, b]
            for k in range(square.size):
                square[k] += factor * (wanted - T[r, c, k]) ** 2


@kernel
def _restart(target, bounds, lanes, b, starts, found):
    """Begin another search, from the unused start whose pose is nearest to the goal.

    After all of these the last one goes on from the best that was found.
    """
    run, nearest, chosen = lanes.run[b], np.inf, 0
    lanes.search[b] += 1
    lanes.iteration[b] = 0
    if lanes.search[b] > starts.q.shape[1]:
        _load(found.q[run], lanes, b)
        lanes.best[b] = np.inf
        return
    distance = np.empty(starts.q.shape[1])
    _distances(target, lanes.goal, b, starts.poses, distance)
    for k in range(distance.size):
        if lanes.begun[b] < distance[k] < nearest:
            nearest, chosen = distance[k], k
    lanes.begun[b] = nearest
    found.restarts[run] += 1
    _load(starts.q0[run], lanes, b)
    for i in bounds.row:
        if i >= 0:
            lanes.q[i, b] = starts.q[i, chosen]


@part
def _lanes(nq, B):
    """Return B idle lanes."""
    whole, real = np.zeros((4, B), np.int64), np.zeros((6, B))
    every = real[0], real[1], real[2], real[3], real[4], real[5]
    goal, q = np.zeros((3, 4, B)), np.zeros((nq, B))
    return Lanes(whole[0], whole[1], whole[2], whole[3], *every, goal, q)


@kernel
def begin(joints, target, goals, starts, found):
    """Return the first runs in their lanes, room for a model, and zero velocities (nv, lanes)."""
    runs = goals.shape[0]
    B = min(LANES, runs)
    lanes = _lanes(starts.q0.shape[1], B)
    for run in range(runs):
        found.q[run] = starts.q0[run]  # where the error is not a number
        found.error[run], found.reason[run] = np.inf, ITERATIONS
        found.iterations[run], found.restarts[run] = 0, 0
    for b in range(B):
        _enter(lanes, b, b, goals, starts.q0)
    return lanes, room(joints, target.moves.columns.size, B), np.zeros((target.rest.size, B))


@kernel
def decide(target, bounds, goals, starts, tolerance, iterations, lanes, model, found, queue):
    """Decide for each lane: take the step, begin anew, go back, or take another run.

    `queue` holds the number of the next run, and how many lanes go on.
    """
    runs, restarts = goals.shape[0], starts.q.shape[1]
    _search(lanes, model, tolerance, restarts, iterations)
    _book(lanes, model, tolerance, restarts, found)
    _descend(lanes, model, restarts)
    for b in range(lanes.run.size):
        if lanes.turn[b] == DONE and queue[0] < runs:
            _enter(lanes, b, queue[0], goals, starts.q0)
            queue[0] += 1
        elif lanes.turn[b] == DONE:
            lanes.run[b] = -1
            queue[1] -= 1
        elif lanes.turn[b] == OVER:
            _restart(target, bounds, lanes, b, starts, found)
        elif lanes.turn[b] == BACK:
            _load(found.q[lanes.run[b]], lanes, b)
        if lanes.turn[b] != STEP:
            for j in range(model.step.shape[0]):
                model.step[j, b] = 0.0


@kernel
def solve(
    integers,
    numbers,
    body,
    offset,
    columns,
    moved,
    sign,
    rest,
    weight,
    pointing,
    row,
    low,
    high,
    turns,
    goals,
    q0,
    q,
    poses,
    tolerance,
    iterations,
    found_q,
    error,
    reason,
    iterated,
    restarted,
):
    """Search coordinates that bring a link to goals[run, 4, 4], to within the tolerance.

    The first search begins at q0, each further one at the start whose pose is nearest the goal;
    each has so many iterations. The arguments are those of a Target, Bounds, Starts and Found.
    """
    moves = jacobian.Moves(columns, moved, sign)
    joints, starts = unpack(integers, numbers), Starts(q0, q, poses)
    target = Target(body, offset, moves, rest, weight, pointing)
    bounds = Bounds(row, low, high, turns)
    found = Found(found_q, error, reason, iterated, restarted)
    lanes, model, v = begin(joints, target, goals, starts, found)
    queue = np.full(2, lanes.run.size)
    while queue[1] > 0:
        propose(joints, target, bounds, lanes, model)
        decide(target, bounds, goals, starts, tolerance, iterations, lanes, model, found, queue)
        jacobian.spread(target.moves.columns, model.step, target.rest, v)
        tree.integrate(joints, v, 1.0, lanes.q)
        confine(bounds, lanes.q)
