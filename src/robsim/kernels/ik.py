"""Inverse kinematics: damped least squares from several starts, many runs side by side.

The step is (J'J + w I)^-1 J'e with w in proportion to the squared error: S. K. Chan and
P. D. Lawrence, General inverse kinematics with the error damped pseudoinverse, ICRA 1988;
T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
T-RO 27(5), 2011.

The runs of a batch pass through a few lanes in lockstep; where one is done, the next takes its
lane. What happens in a lane depends on its own run alone, so its bits do too.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import se3, tree
from robsim.kernels.jit import kernel, part
from robsim.kernels.normal import damped_step, transposed_product

SOLVED, UNREACHABLE, LIMITS, ITERATIONS = 1, 2, 3, 4
REST, STEP, BACK, OVER, DONE = 0, 1, 2, 3, 4  # what a lane may do after an iteration
LANES = 64
DAMPING = 0.015  # times e'e
FAR = 10.0  # of e'e: more than that does not damp more, or steps would be too small to arrive
FLOOR = 1e-12  # of the damping: keeps Cholesky's pivots positive
STILL = 1e-3  # cosine of e and the columns of J, and share of e'e that a step would gain
PERIOD, FALL = 4, 0.5  # a search goes on while e'e falls by this factor in so many iterations
LONGER = 10  # times the iterations of others: the last search, which looks for the least error


class Target(NamedTuple):
    """What is brought to a pose, and which part of the pose counts."""

    body: int
    offset: Any  # (3, 4) of the link in its body
    moves: Any  # `tree.Moves` of the velocities that carry the link
    rest: Any  # (nv,) zeros
    weight: Any  # (6,) of the rows (v, omega), in the axes of the base
    pointing: bool  # of the rotation only where the z axis points


class Bounds(NamedTuple):
    """Where coordinates may be."""

    row: Any  # of each velocity that carries the link, its only coordinate, or -1
    low: Any  # (nq,), infinite where there is none
    high: Any
    turns: Any  # (nq,) whether a whole turn changes nothing


class Starts(NamedTuple):
    """Where searches may begin."""

    q0: Any  # (nq, run), the first
    q: Any  # (nq, k), the others
    poses: Any  # (3, 4, k) of the link there


class Found(NamedTuple):
    """What was found; the run last."""

    q: Any
    error: Any  # the larger of the metres and the radians that count
    reason: Any
    iterations: Any
    restarts: Any


class Lanes(NamedTuple):
    """The searches that go on."""

    run: Any  # of the batch, or -1
    search: Any  # its number, 0 from q0
    iteration: Any  # of this search
    turn: Any  # what it does next
    begun: Any  # distance from the goal to where this search began
    best: Any  # least e'e of the run
    mark: Any  # e'e of this search some iterations ago
    boost: Any  # of the damping
    hoped: Any  # by how much e'e was to fall
    error: Any
    goal: Any  # (3, 4, lanes)
    q: Any


class Model(NamedTuple):
    """The linear model around the coordinates of each lane, and the step that it proposes."""

    bodies: Any
    T: Any  # of the link
    e: Any  # (6, lanes), weighted
    square: Any  # e'e
    J: Any  # (6, n, lanes), weighted
    downhill: Any  # J'e
    damping: Any
    step: Any
    held: Any  # how many joints are held by their limits
    gain: Any  # by how much e'e should fall, at least
    still: Any  # whether that is next to nothing


@kernel
def _turn_to(goal, T, w):
    """w[3, b] = rotation vector of R_goal R', in base axes."""
    between, quaternion = np.empty(T.shape), np.empty((4, T.shape[2]))
    for r in range(3):
        for c in range(3):
            for b in range(T.shape[2]):
                between[r, c, b] = (
                    goal[r, 0, b] * T[c, 0, b]
                    + goal[r, 1, b] * T[c, 1, b]
                    + goal[r, 2, b] * T[c, 2, b]
                )
    se3.rotation_to_quaternion(between, quaternion)
    se3.rotation_vector(quaternion, w)


@kernel
def _point_to(goal, T, w):
    """w[3, b] of the shortest turn of the z axis of T to that of the goal, in base axes."""
    for b in range(T.shape[2]):
        zx, zy, zz = T[0, 2, b], T[1, 2, b], T[2, 2, b]
        gx, gy, gz = goal[0, 2, b], goal[1, 2, b], goal[2, 2, b]
        x, y, z = zy * gz - zz * gy, zz * gx - zx * gz, zx * gy - zy * gx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, zx * gx + zy * gy + zz * gz)
        if sine == 0.0:  # straight on, or straight back: then about x
            x, y, z, sine = T[0, 0, b], T[1, 0, b], T[2, 0, b], 1.0
        scale = angle / sine
        w[0, b], w[1, b], w[2, b] = scale * x, scale * y, scale * z


@part
def _ignore_roll(T, J):
    """Take what turns about the z axis of T out of the lower rows of J."""
    for j in range(J.shape[1]):
        for b in range(J.shape[2]):
            x, y, z = T[0, 2, b], T[1, 2, b], T[2, 2, b]
            roll = x * J[3, j, b] + y * J[4, j, b] + z * J[5, j, b]
            J[3, j, b] -= roll * x
            J[4, j, b] -= roll * y
            J[5, j, b] -= roll * z


@part
def _length(e, weight, half, b):
    """Of the three rows from `half` on, as far as they count."""
    square = 0.0
    for r in range(half, half + 3):
        square += e[r, b] * e[r, b] if weight[r] > 0.0 else 0.0
    return math.sqrt(square)


@kernel
def _residual(target, goal, model, error):
    """e = (p_goal - p, w), weighted; its square, and the error without weights."""
    T, e, weight = model.T, model.e, target.weight
    for r in range(3):
        for b in range(error.size):
            e[r, b] = goal[r, 3, b] - T[r, 3, b]
    if target.pointing:
        _point_to(goal, T, e[3:])
    else:
        _turn_to(goal, T, e[3:])
    for b in range(error.size):
        error[b] = max(_length(e, weight, 0, b), _length(e, weight, 3, b))
        model.square[b] = 0.0
    for r in range(6):
        for b in range(error.size):
            e[r, b] *= weight[r]
            model.square[b] += e[r, b] * e[r, b]


@part
def _jacobian(target, model):
    """J of e, but for its sign and the slow change of w."""
    J = model.J
    tree.jacobian(model.bodies, model.T[:, 3], target.moves, J)
    if target.pointing:
        _ignore_roll(model.T, J)
    for r in range(6):
        for j in range(J.shape[1]):
            for b in range(J.shape[2]):
                J[r, j, b] *= target.weight[r]
    transposed_product(J, model.e, model.downhill)


@part
def _hold(bounds, q, model):
    """A joint that stands at a limit and is drawn outwards takes no part in the step."""
    J, downhill, held = model.J, model.downhill, model.held
    for b in range(held.size):
        held[b] = 0
    for j in range(bounds.row.size):
        i = bounds.row[j]
        if i >= 0 and not (bounds.turns[i] and bounds.high[i] - bounds.low[i] >= 2.0 * math.pi):
            for b in range(held.size):
                if (q[i, b] <= bounds.low[i] and downhill[j, b] < 0.0) or (
                    q[i, b] >= bounds.high[i] and downhill[j, b] > 0.0
                ):
                    held[b] += 1
                    downhill[j, b] = 0.0
                    for r in range(6):
                        J[r, j, b] = 0.0


@part
def _judge(model):
    """A lane is still where the step gains little, and e is square to all columns of J."""
    J, downhill, gain = model.J, model.downhill, model.gain
    for b in range(gain.size):
        cosine = 0.0  # squared, times e'e
        gain[b] = 0.0
        for j in range(J.shape[1]):
            column = 0.0
            for r in range(6):
                column += J[r, j, b] * J[r, j, b]
            gain[b] += downhill[j, b] * model.step[j, b]
            if column > 0.0:
                cosine = max(cosine, downhill[j, b] * downhill[j, b] / column)
        few = STILL * model.square[b]
        model.still[b] = gain[b] <= few and cosine <= STILL * few


@kernel
def _propose(joints, target, bounds, lanes, model):
    """The model and the step of every lane, idle ones included."""
    tree.bodies(joints, lanes.q, model.bodies)
    tree.frame(model.bodies.poses, target.body, target.offset, model.T)
    _residual(target, lanes.goal, model, lanes.error)
    _jacobian(target, model)
    _hold(bounds, lanes.q, model)
    for b in range(lanes.run.size):
        model.damping[b] = DAMPING * lanes.boost[b] * min(model.square[b], FAR) + FLOOR
    damped_step(model.J, model.e, model.downhill, model.damping, model.step)
    _judge(model)


@part
def _put(q, b, out, run):
    for i in range(q.shape[0]):
        out[i, run] = q[i, b]


@kernel
def _search(lanes, model, tolerance, restarts, iterations):
    """What each lane does now; a search is over where it is still, stuck, or took too long."""
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
    """Where a search ends, keep what is better than all before it; in the last one, at once."""
    for b in range(lanes.run.size):
        run, ends = lanes.run[b], lanes.turn[b] == OVER or lanes.turn[b] == DONE
        if ends:
            found.iterations[run] += lanes.iteration[b]
        looks = run >= 0 and (ends or lanes.search[b] > restarts)
        if looks and model.square[b] < lanes.best[b]:
            lanes.best[b], found.error[run] = model.square[b], lanes.error[b]
            _put(lanes.q, b, found.q, run)
            if lanes.error[b] < tolerance:
                found.reason[run] = SOLVED
            elif model.still[b]:
                found.reason[run] = LIMITS if model.held[b] > 0 else UNREACHABLE
            else:
                found.reason[run] = ITERATIONS


@kernel
def _descend(lanes, model, restarts):
    """The last search goes back where it went uphill, and damps as the model deserves.

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
    """A run enters a lane."""
    lanes.run[b], lanes.search[b], lanes.iteration[b] = run, 0, 0
    lanes.begun[b], lanes.best[b], lanes.boost[b] = -1.0, np.inf, 1.0
    for r in range(3):
        for c in range(4):
            lanes.goal[r, c, b] = goals[r, c, run]
    _put(q0, run, lanes.q, b)


@kernel
def _distances(target, goal, b, T, square):
    """square[k] of T[3, 4, k] from goal b, with mean weights; |R - R_goal|^2/2 = 2 - 2 cos."""
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
    """Another search: from the start whose pose is nearest the goal, of all that are left.

    After all of these the last one goes on from the best that was found.
    """
    run, nearest, chosen = lanes.run[b], np.inf, 0
    lanes.search[b] += 1
    lanes.iteration[b] = 0
    if lanes.search[b] > starts.q.shape[1]:
        _put(found.q, run, lanes.q, b)
        lanes.best[b] = np.inf
        return
    distance = np.empty(starts.q.shape[1])
    _distances(target, lanes.goal, b, starts.poses, distance)
    for k in range(distance.size):
        if lanes.begun[b] < distance[k] < nearest:
            nearest, chosen = distance[k], k
    lanes.begun[b] = nearest
    found.restarts[run] += 1
    _put(starts.q0, run, lanes.q, b)
    for i in bounds.row:
        if i >= 0:
            lanes.q[i, b] = starts.q[i, chosen]


@kernel
def _confine(bounds, q):
    """Coordinates back into their limits: by whole turns where that helps, else to the limit."""
    for i in bounds.row:
        if i >= 0:
            low, high = bounds.low[i], bounds.high[i]
            for b in range(q.shape[1]):
                if not low <= q[i, b] <= high:
                    x = q[i, b]
                    if bounds.turns[i]:
                        x -= 2.0 * math.pi * math.ceil((x - high) / (2.0 * math.pi))
                    q[i, b] = x if low <= x <= high else min(max(q[i, b], low), high)


@part
def _lanes(nq, B):
    """Idle ones."""
    whole, real = np.zeros((4, B), np.int64), np.zeros((6, B))
    every = real[0], real[1], real[2], real[3], real[4], real[5]
    goal, q = np.zeros((3, 4, B)), np.zeros((nq, B))
    return Lanes(whole[0], whole[1], whole[2], whole[3], *every, goal, q)


@part
def _model(joints, n, B):
    """Room for one."""
    poses = np.empty((joints.rows.shape[0], 3, 4, B))
    bodies = tree.Bodies(poses, np.empty((joints.ratios, B)))
    e, J, real = np.empty((6, B)), np.empty((6, n, B)), np.empty((3, B))
    held, still = np.empty(B, np.int64), np.empty(B, np.bool_)
    T, downhill, step = np.empty((3, 4, B)), np.empty((n, B)), np.empty((n, B))
    return Model(bodies, T, e, real[0], J, downhill, real[1], step, held, real[2], still)


@kernel
def solve(joints, target, bounds, goals, starts, tolerance, iterations, found):
    """Bring a link to goals[3, 4, run]: solved where the error comes below the tolerance.

    The first search begins at q0, each further one at the start whose pose is nearest the goal;
    each has so many iterations.
    """
    runs, columns = goals.shape[2], target.moves.columns
    B, restarts = min(LANES, runs), starts.q.shape[1]
    lanes, model = _lanes(starts.q0.shape[0], B), _model(joints, columns.size, B)
    v = np.zeros((target.rest.size, B))
    for run in range(runs):
        found.iterations[run], found.restarts[run] = 0, 0
    for b in range(B):
        _enter(lanes, b, b, goals, starts.q0)
    following, going = B, B
    while going > 0:
        _propose(joints, target, bounds, lanes, model)
        _search(lanes, model, tolerance, restarts, iterations)
        _book(lanes, model, tolerance, restarts, found)
        _descend(lanes, model, restarts)
        for b in range(B):
            if lanes.turn[b] == DONE and following < runs:
                _enter(lanes, b, following, goals, starts.q0)
                following += 1
            elif lanes.turn[b] == DONE:
                lanes.run[b] = -1
                going -= 1
            elif lanes.turn[b] == OVER:
                _restart(target, bounds, lanes, b, starts, found)
            elif lanes.turn[b] == BACK:
                _put(found.q, lanes.run[b], lanes.q, b)
            if lanes.turn[b] != STEP:
                for j in range(columns.size):
                    model.step[j, b] = 0.0
        tree.spread(columns, model.step, target.rest, v)
        tree.integrate(joints, v, 1.0, lanes.q)
        _confine(bounds, lanes.q)
