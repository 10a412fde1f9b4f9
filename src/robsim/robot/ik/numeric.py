"""Inverse kinematics: coordinates that bring a link to a pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, numbers, positive, runs_first, runs_last, whole
from robsim.base.errors import InputError, suggest
from robsim.base.threads import processors
from robsim.base.values import Value
from robsim.geometry.pose import as_pose, common_lead
from robsim.kernels import ik as kernels
from robsim.kernels import random
from robsim.kernels.tree import CAR, REVOLUTE, UNICYCLE
from robsim.robot.tree import Tree

MASKS = {"pose": (1,) * 6, "position": (1, 1, 1, 0, 0, 0), "pointing": (1,) * 6}
FINEST = 1e-12  # metres or radians: less is rounding
FARTHEST = 1e9  # metres or radians: more could overflow, and stands for no limit in files
LIGHTEST = 1e-3  # of weights, against the heaviest: rows of less are not brought to a tolerance
CHUNK = 16384  # runs that one thread takes at a time
FREE = {"rad": math.pi, "m": 1.0}  # how far from home a search begins where there is no limit


class IKReason(IntEnum):
    """Why the search for coordinates ended; `message` says what it means.

    >>> IKReason.SOLVED.message
    'solved: the link is at the pose, within the limits'
    """

    SOLVED = kernels.SOLVED
    UNREACHABLE = kernels.UNREACHABLE
    LIMITS = kernels.LIMITS
    ITERATIONS = kernels.ITERATIONS

    @property
    def message(self) -> str:
        """One sentence for the user."""
        return f"{self.name.lower()}: {_MESSAGES[self]}"


_MESSAGES = {
    IKReason.SOLVED: "the link is at the pose, within the limits",
    IKReason.UNREACHABLE: (
        "no small motion lessens the least error that was found, and without limits it was not "
        "reached either; the pose is out of reach, or try more restarts"
    ),
    IKReason.LIMITS: (
        "limits of joints stand in the way of the pose: without them it was reached, or they hold "
        "the least error that was found; try more restarts"
    ),
    IKReason.ITERATIONS: "the error was still falling at the end; try more iterations or restarts",
}


@dataclass(frozen=True, eq=False)
class IKResult(Value):
    """What `Robot.ik` found, row by row; for a single pose without the leading axes.

    q           (..., nq) with the least error that was found, within the limits
    success     (...,) whether that is a solution: `error` is below the tolerance
    error       (...,) the larger of the metres and the radians that count, by forward kinematics
                of q: |p_goal - p| and the angle from R to R_goal (or from z axis to z axis)
    iterations  (...,) how often the link was placed, over all searches within the limits
    restarts    (...,) how many searches began elsewhere than at q0
    reason      (...,) codes of `IKReason`; for a single pose one of these

    >>> from robsim import Robot
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], limits=[[-1, 1]])
    >>> found = arm.ik(arm.fk([[0.5], [1.5]]))
    >>> found.q.round(9)[:, 0], [IKReason(code).name for code in found.reason]
    (array([0.5, 1. ]), ['SOLVED', 'LIMITS'])
    """

    q: Array
    success: Any
    error: Any
    iterations: Any
    restarts: Any
    reason: Any


class Arm(NamedTuple):
    """What is to be moved: a link of a tree, its coordinates, and what users call them."""

    tree: Tree
    link: str
    limits: Array  # (nq, 2), infinite where there are none
    home: Array
    units: Sequence[str]  # of the coordinates
    velocities: Sequence[str]


class Effort(NamedTuple):
    """How well, and how long, to search."""

    tolerance: float
    iterations: int
    restarts: int
    seed: int
    threads: int

    @classmethod
    def checked(
        cls, tolerance: Any, iterations: Any, restarts: Any, seed: Any, threads: Any
    ) -> Effort:
        """InputError for what cannot be."""
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
    """Coordinates for poses T (..., 4, 4) of the link in the base, searched from q0 (..., nq)."""
    goal = as_pose(T).matrix
    if (np.abs(goal[..., :3, 3]) > FARTHEST).any():
        raise InputError(f"T: no position may be farther than {FARTHEST:g} m")
    lead = common_lead(goal.shape[:-2], q0.shape[:-1], "T and q0")
    goals = runs_last(np.broadcast_to(goal[..., :3, :], (*lead, 3, 4)), 2)
    first = runs_last(np.broadcast_to(q0, (*lead, q0.shape[-1])), 1)
    target = _target(arm, mask)
    found = _searched(arm, target, goals, first, effort)
    if np.isfinite(arm.limits).any():
        _tell_limits(arm, target, goals, found, effort)
    return _result(found, lead)


def _searched(
    arm: Arm, target: kernels.Target, goals: Array, q0: Array, effort: Effort
) -> kernels.Found:
    """What is found for goals[3, 4, run] from q0[nq, run]."""
    bounds = _bounds(arm)
    starts = _starts(arm, bounds, effort)

    def job(start: int, end: int) -> kernels.Found:
        some, q = (array[..., start:end].copy() for array in (goals, q0))
        return _search(arm.tree, target, bounds, some, q, starts, effort)

    return _in_chunks(job, goals.shape[-1], effort.threads)


def _tell_limits(
    arm: Arm, target: kernels.Target, goals: Array, found: kernels.Found, effort: Effort
) -> None:
    """Where nothing was found: whether it is there without limits says if these are the reason."""
    lost = np.flatnonzero(np.isin(found.reason, (kernels.UNREACHABLE, kernels.LIMITS)))
    if lost.size:
        free = arm._replace(limits=np.full_like(arm.limits, np.inf) * [-1.0, 1.0])
        reason = _searched(free, target, goals[..., lost], found.q[:, lost], effort).reason
        found.reason[lost[reason == kernels.SOLVED]] = kernels.LIMITS
        found.reason[lost[reason == kernels.UNREACHABLE]] = kernels.UNREACHABLE


def _target(arm: Arm, mask: Any) -> kernels.Target:
    """The link and what counts of its pose; InputError if no joint can bring it anywhere."""
    columns = np.flatnonzero(arm.tree.carries(arm.link))
    if columns.size == 0:
        raise InputError(f"no joint moves link '{arm.link}', so it cannot be brought to a pose")
    for j in columns.tolist():
        if arm.tree.kinds[j] in (UNICYCLE, CAR):
            raise InputError(
                f"link '{arm.link}' rides on a vehicle, by its velocity '{arm.velocities[j]}'; "
                "a vehicle has to be driven to a pose, inverse kinematics cannot place it"
            )
    body, offset = arm.tree.find(arm.link)
    moves = arm.tree.moves(arm.tree.carried(arm.link), frozen(columns))
    weight, place = _weights(mask), frozen(np.ascontiguousarray(offset[:3]))
    rest = frozen(np.zeros(arm.tree.nv))
    return kernels.Target(body, place, moves, rest, weight, _is(mask, "pointing"))


def _is(mask: Any, name: str) -> bool:
    return isinstance(mask, str) and mask == name


def _weights(mask: Any) -> Array:
    """(6,) of the rows (v, omega)."""
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


def _bounds(arm: Arm) -> kernels.Bounds:
    """Limits; a joint that may turn for ever is kept within half a turn of zero."""
    columns = np.flatnonzero(arm.tree.carries(arm.link))
    row = arm.tree.alone(columns)
    turns = np.zeros(len(arm.limits), dtype=np.bool_)
    turns[row[(arm.tree.kinds[columns] == REVOLUTE) & (row >= 0)]] = True
    turns[np.intersect1d(arm.tree.joints.ties.rows[:, 1], np.flatnonzero(turns))] = False
    endless = turns & np.isinf(arm.limits).all(axis=1)
    low, high = arm.limits.T.copy()
    low[endless], high[endless] = -math.pi, math.pi
    return kernels.Bounds(row, frozen(low), frozen(high), frozen(turns))


def _starts(arm: Arm, bounds: kernels.Bounds, effort: Effort) -> tuple[Array, Array]:
    """Where further searches may begin, q (nq, k), and the link's poses there.

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


def _search(
    tree: Tree,
    target: kernels.Target,
    bounds: kernels.Bounds,
    goals: Array,
    q0: Array,
    starts: tuple[Array, Array],
    effort: Effort,
) -> kernels.Found:
    runs = goals.shape[-1]
    counts = (np.full(runs, value) for value in (kernels.ITERATIONS, 0, 0))
    found = kernels.Found(q0.copy(), np.full(runs, np.inf), *counts)  # what overflows stays so
    kernels.solve(
        tree.joints,
        target,
        bounds,
        goals,
        kernels.Starts(q0, *starts),
        effort.tolerance,
        effort.iterations,
        found,
    )
    return found


def _in_chunks(job: Any, runs: int, threads: int) -> kernels.Found:
    """job(start, end) over all runs, by threads where there are many."""
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
