"""Inverse kinematics by iteration: coordinates that bring a link to a pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, numbers, positive, runs_first, runs_last, whole
from robsim.base.errors import InputError, suggest
from robsim.base.threads import processors
from robsim.geometry.pose import as_pose, common_lead
from robsim.kernels import ik as kernels
from robsim.kernels import ik_step, random
from robsim.robot.ik.result import IKReason, IKResult
from robsim.robot.ik.search import in_chunks, search
from robsim.robot.tree import Tree

MASKS = {"pose": (1,) * 6, "position": (1, 1, 1, 0, 0, 0), "pointing": (1,) * 6}
FINEST = 1e-12  # metres or radians: smaller errors are rounding
FARTHEST = 1e9  # metres or radians: larger numbers could overflow; files use them for no limit
LIGHTEST = 1e-3  # smallest weight relative to the largest: smaller ones could not reach a tolerance
FREE = {"rad": math.pi, "m": 1.0}  # how far from home a search begins, without limits


class Arm(NamedTuple):
    """The problem of inverse kinematics: a link of a tree, its coordinates, and their names."""

    tree: Tree
    link: str
    limits: Array  # (nq, 2), infinite where there are none
    home: Array
    units: Sequence[str]  # of the coordinates
    velocities: Sequence[str]


class Effort(NamedTuple):
    """The accuracy and the amount of work of a search."""

    tolerance: float
    iterations: int
    restarts: int
    seed: int
    threads: int

    @classmethod
    def checked(
        cls, tolerance: Any, iterations: Any, restarts: Any, seed: Any, threads: Any
    ) -> Effort:
        """Return checked settings; raise InputError for values that cannot be used."""
        finest = positive(tolerance, "tolerance (metres and radians)")
        if finest < FINEST:
            raise InputError(f"tolerance must be at least {FINEST:g}, got {tolerance!r}")
        return cls(
            finest,
            whole(iterations, "iterations", 1, 10**6),
            whole(restarts, "restarts", 0, 10**5),
            whole(seed, "seed", 0, 2**64),
            whole(processors() if threads is None else threads, "threads", 1, 1025),
        )


def solve(arm: Arm, T: Any, q0: Array, mask: Any, effort: Effort) -> IKResult:
    """Return coordinates (..., nq) for poses T (..., 4, 4) of the link in the base, from q0."""
    goal = as_pose(T).matrix
    if (np.abs(goal[..., :3, 3]) > FARTHEST).any():
        raise InputError(f"T: no position may be farther than {FARTHEST:g} m")
    lead = common_lead(goal.shape[:-2], q0.shape[:-1], "T and q0")
    goals = runs_last(np.broadcast_to(goal[..., :3, :], (*lead, 3, 4)), 2)
    first = runs_last(np.broadcast_to(q0, (*lead, q0.shape[-1])), 1)
    target = _target(arm, mask)
    found = _searched(arm, target, goals, first, effort)
    if np.isfinite(arm.limits).any():
        _explain_by_limits(arm, target, goals, found, effort)
    return _result(found, lead)


def _searched(
    arm: Arm, target: ik_step.Target, goals: Array, q0: Array, effort: Effort
) -> kernels.Found:
    """Return the result of a search for goals[3, 4, run] from q0[nq, run]."""
    bounds = _bounds(arm)
    starts = _starts(arm, bounds, effort)

    pace = effort.tolerance, effort.iterations

    def job(start: int, end: int) -> kernels.Found:
        some, q = (array[..., start:end].copy() for array in (goals, q0))
        return search(arm.tree, target, bounds, some, q, starts, *pace)

    return in_chunks(job, goals.shape[-1], effort.threads)


def _explain_by_limits(
    arm: Arm, target: ik_step.Target, goals: Array, found: kernels.Found, effort: Effort
) -> None:
    """Set whether failures are due to the limits, by a search without limits."""
    lost = np.flatnonzero(np.isin(found.reason, (kernels.UNREACHABLE, kernels.LIMITS)))
    if lost.size:
        free = arm._replace(limits=np.full_like(arm.limits, np.inf) * [-1.0, 1.0])
        reason = _searched(free, target, goals[..., lost], found.q[:, lost], effort).reason
        found.reason[lost[reason == kernels.SOLVED]] = kernels.LIMITS
        found.reason[lost[reason == kernels.UNREACHABLE]] = kernels.UNREACHABLE


def _target(arm: Arm, mask: Any) -> ik_step.Target:
    """Return the link and the rows of its pose that count; InputError if no joint moves it."""
    columns = np.flatnonzero(arm.tree.carries(arm.link))
    if columns.size == 0:
        raise InputError(f"no joint moves link '{arm.link}', so it cannot be brought to a pose")
    for j, kind in zip(columns.tolist(), arm.tree.kinds(columns), strict=True):
        if kind.wheeled:
            raise InputError(
                f"link '{arm.link}' rides on a vehicle, by its velocity '{arm.velocities[j]}'; "
                "a vehicle has to be driven to a pose, inverse kinematics cannot place it"
            )
    body, offset = arm.tree.find(arm.link)
    moves = arm.tree.moves(arm.tree.carried(arm.link), frozen(columns))
    weight, place = _weights(mask), frozen(np.ascontiguousarray(offset[:3]))
    rest = frozen(np.zeros(arm.tree.nv))
    return ik_step.Target(body, place, moves, rest, weight, _is(mask, "pointing"))


def _is(mask: Any, name: str) -> bool:
    return isinstance(mask, str) and mask == name


def _weights(mask: Any) -> Array:
    """Return the weights (6,) of the rows (v, omega)."""
    if mask is None or isinstance(mask, str):
        name = "pose" if mask is None else mask
        if name not in MASKS:
            raise InputError(
                f"no mask {name!r}; {suggest(name, MASKS, 'masks')}, or six weights (v, omega)"
            )
        return frozen(np.array(MASKS[name], dtype=float))
    weight = numbers(mask, "mask: weights of (v, omega) in base axes", (6,))
    if weight.ndim > 1 or (weight < 0).any() or not weight.any():
        raise InputError(
            f"mask: expected six weights not below 0 and not all 0, got {weight.tolist()!r:.80}"
        )
    weight = weight / weight.max()
    if (weight[weight > 0] < LIGHTEST).any():
        raise InputError(f"mask: a weight is 0, or at least {LIGHTEST:g} of the largest one")
    return frozen(weight)


def _bounds(arm: Arm) -> ik_step.Bounds:
    """Return the limits; a joint without limits is kept within half a turn of zero."""
    columns = np.flatnonzero(arm.tree.carries(arm.link))
    row = arm.tree.alone(columns)
    turns = np.zeros(len(arm.limits), dtype=np.bool_)
    turning = np.array([kind.turns for kind in arm.tree.kinds(columns)], dtype=np.bool_)
    turns[row[turning & (row >= 0)]] = True
    turns[np.intersect1d(arm.tree.joints.ties.rows[:, 1], np.flatnonzero(turns))] = False
    endless = turns & np.isinf(arm.limits).all(axis=1)
    low, high = arm.limits.T.copy()
    low[endless], high[endless] = -math.pi, math.pi
    return ik_step.Bounds(row, frozen(low), frozen(high), frozen(turns))


def _starts(arm: Arm, bounds: ik_step.Bounds, effort: Effort) -> tuple[Array, Array]:
    """Return starts of further searches, q (nq, k), and the link's poses there.

    Uniform within the limits, by the seed and the number of the start alone, the same for every
    run: so a run has the same bits in every batch.
    """
    free = np.array([FREE.get(unit, 0.0) for unit in arm.units])
    low = np.where(bounds.low < -FARTHEST, arm.home - free, bounds.low)
    high = np.where(bounds.high > FARTHEST, arm.home + free, bounds.high)
    share = np.empty((len(low), effort.restarts))
    random.uniforms(
        np.uint64(effort.seed), np.arange(effort.restarts, dtype=np.uint64), 0, 0, share
    )
    q = np.repeat(arm.home[:, None], effort.restarts, axis=1)
    rows = bounds.row[bounds.row >= 0]
    q[rows] = (low[:, None] + share * (high - low)[:, None])[rows]
    return q, arm.tree.frame(arm.tree.bodies(q), arm.link)


def _result(found: kernels.Found, lead: tuple[int, ...]) -> IKResult:
    q = frozen(runs_first(found.q, lead))

    def shaped(array: NDArray[Any]) -> Any:
        return frozen(array.reshape(lead)) if lead else array[0]

    reason = shaped(found.reason) if lead else IKReason(int(found.reason[0]))
    return IKResult(
        q,
        shaped(found.reason == kernels.SOLVED),
        shaped(found.error),
        shaped(found.iterations),
        shaped(found.restarts),
        reason,
    )
