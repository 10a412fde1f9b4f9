"""A step of inverse kinematics for several lanes side by side, by damped least squares.

The step is (J'J + w I)^-1 J'e with w in proportion to the squared error: S. K. Chan and
P. D. Lawrence, General inverse kinematics with the error damped pseudoinverse, ICRA 1988;
T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
T-RO 27(5), 2011.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import jacobian, se3, tree
from robsim.kernels.jit import kernel, part
from robsim.kernels.normal import damped_step, transposed_product

DAMPING = 0.015  # times e'e
FAR = 10.0  # of e'e: more than that does not damp more, or steps would be too small to arrive
FLOOR = 1e-12  # of the damping: keeps Cholesky's pivots positive
STILL = 1e-3  # cosine of e and the columns of J, and share of e'e that a step would gain


class Target(NamedTuple):
    """The link that is brought to a pose, and the weights of the rows of its pose."""

    body: int
    offset: Any  # (3, 4) of the link in its body
    moves: Any  # `jacobian.Moves` of the velocities that carry the link
    rest: Any  # (nv,) zeros
    weight: Any  # (6,) of the rows (v, omega), in the axes of the base
    pointing: bool  # of the rotation only where the z axis points


class Bounds(NamedTuple):
    """The limits of coordinates."""

    row: Any  # of each velocity that carries the link, its only coordinate, or -1
    low: Any  # (nq,), infinite where there is none
    high: Any
    turns: Any  # (nq,) whether a whole turn changes nothing


class Lanes(NamedTuple):
    """The searches in progress."""

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
    """Compute w[3, b], the rotation vector of R_goal R', in base axes."""
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
    """Compute w[3, b] of the shortest rotation of the z axis of T to the goal's, in base axes."""
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
    """Remove rotation about the z axis of T from the lower rows of J."""
    for j in range(J.shape[1]):
        for b in range(J.shape[2]):
            x, y, z = T[0, 2, b], T[1, 2, b], T[2, 2, b]
            roll = x * J[3, j, b] + y * J[4, j, b] + z * J[5, j, b]
            J[3, j, b] -= roll * x
            J[4, j, b] -= roll * y
            J[5, j, b] -= roll * z


@part
def _length(e, weight, half, b):
    """Return the length of the three rows from `half` on, without rows of weight zero."""
    square = 0.0
    for r in range(half, half + 3):
        square += e[r, b] * e[r, b] if weight[r] > 0.0 else 0.0
    return math.sqrt(square)


@kernel
def _residual(target, goal, model, error):
    """Compute e = (p_goal - p, w), weighted, its square, and the error without weights."""
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
    """Compute the Jacobian of e, but for its sign and the slow change of w."""
    J = model.J
    jacobian.jacobian(model.bodies, model.T[:, 3], target.moves, J)
    if target.pointing:
        _ignore_roll(model.T, J)
    for r in range(6):
        for j in range(J.shape[1]):
            for b in range(J.shape[2]):
                J[r, j, b] *= target.weight[r]
    transposed_product(J, model.e, model.downhill)


@part
def _hold(bounds, q, model):
    """Exclude joints at a limit that would move outwards from the step."""
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
    """Mark a lane as still where the step gains little, and e is normal to all columns of J."""
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
def propose(joints, target, bounds, lanes, model):
    """Compute the model and the step of every lane, idle ones included."""
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
def room(joints, n, B):
    """Return a Model with uninitialised arrays."""
    poses = np.empty((joints.rows.shape[0], 3, 4, B))
    bodies = tree.Bodies(poses, np.empty((joints.ratios, B)))
    e, J, real = np.empty((6, B)), np.empty((6, n, B)), np.empty((3, B))
    held, still = np.empty(B, np.int64), np.empty(B, np.bool_)
    T, downhill, step = np.empty((3, 4, B)), np.empty((n, B)), np.empty((n, B))
    return Model(bodies, T, e, real[0], J, downhill, real[1], step, held, real[2], still)


@kernel
def confine(bounds, q):
    """Move coordinates into their limits: by whole turns where that helps, else to the limit."""
    for i in bounds.row:
        if i >= 0:
            low, high = bounds.low[i], bounds.high[i]
            for b in range(q.shape[1]):
                if not low <= q[i, b] <= high:
                    x = q[i, b]
                    if bounds.turns[i]:
                        x -= 2.0 * math.pi * math.ceil((x - high) / (2.0 * math.pi))
                    q[i, b] = x if low <= x <= high else min(max(q[i, b], low), high)
