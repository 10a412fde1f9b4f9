"""Inverse kinematics by iteration: coordinates that bring a link to a pose."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.geometry.pose import PoseLike, as_pose, broadcast_leading_shape
from robsim.kernels.inverse_kinematics import ik_scheduler as kernels
from robsim.robot.ik.arm import LARGEST_POSITION, IKArm
from robsim.robot.ik.descent import IKDescent
from robsim.robot.ik.ik_result import IKReason, IKResult
from robsim.robot.ik.ik_search import SearchBudget, search_coordinates

IK_MASKS = {"pose": (1,) * 6, "position": (1, 1, 1, 0, 0, 0), "pointing": (1,) * 6}
SMALLEST_WEIGHT = 1e-3  # smallest relative weight; with a smaller weight no search converges
IKMask = Literal["pose", "position", "pointing"] | ArrayLike  # a name, or six weights


def solve_numeric(
    arm: IKArm, T: PoseLike, q0: Array, mask: IKMask | None, effort: SearchBudget
) -> IKResult:
    """Return coordinates (..., nq) for poses T (..., 4, 4) of the link in the base, from q0."""
    goal = as_pose(T).matrix
    if np.abs(goal).max(initial=0.0) > LARGEST_POSITION:
        raise InputError(f"T: no position may be farther than {LARGEST_POSITION:g} m")
    lead = broadcast_leading_shape(goal.shape[:-2], q0.shape[:-1], "T and q0")
    goals, first = _broadcast_to_runs(goal, lead, 2), _broadcast_to_runs(q0, lead, 1)
    results = search_coordinates(_find_descent(arm, mask), goals, first, effort)
    solved = results.counts[kernels.REASON] == kernels.SOLVED
    if np.isfinite(arm.limits).any() and np.count_nonzero(solved) < solved.size:
        _attribute_to_limits(arm, mask, goals, results, effort)
    return _make_ik_result(results, solved, lead)


def _broadcast_to_runs(array: Array, lead: tuple[int, ...], axes: int) -> Array:
    """Return an array (..., a, b) with `axes` trailing axes as a read-only array (run, a, b)."""
    tail = array.shape[-axes:]
    broadcast = array if array.shape[:-axes] == lead else np.broadcast_to(array, lead + tail)
    return make_read_only(np.ascontiguousarray(broadcast).reshape(math.prod(lead), *tail))


def _attribute_to_limits(
    arm: IKArm,
    mask: IKMask | None,
    goals: Array,
    results: kernels.SearchResults,
    effort: SearchBudget,
) -> None:
    """Set the reasons of failures to LIMITS or UNREACHABLE, by a search without limits."""
    reasons = results.counts[kernels.REASON]
    failed = np.flatnonzero(np.isin(reasons, (kernels.UNREACHABLE, kernels.LIMITS)))
    if failed.size:
        unlimited, starts = _find_descent(arm.free, mask), make_read_only(results.q[failed])
        reason = search_coordinates(
            unlimited, make_read_only(goals[failed]), starts, effort
        ).counts[kernels.REASON]
        reasons[failed[reason == kernels.SOLVED]] = kernels.LIMITS
        reasons[failed[reason == kernels.UNREACHABLE]] = kernels.UNREACHABLE


def _find_descent(arm: IKArm, mask: IKMask | None) -> IKDescent:
    """Return the search of an arm for a mask; raise InputError if no joint moves the link."""
    is_name = mask is None or isinstance(mask, str)
    if is_name and mask in arm.cache:
        cached: IKDescent = arm.cache[mask]
        return cached
    _check_movable_link(arm)
    descent = IKDescent(arm, _read_mask(mask), is_name and mask == "pointing")
    if is_name:
        arm.cache[mask] = descent
    return descent


def _check_movable_link(arm: IKArm) -> None:
    """Raise InputError if no joint moves the link, or a vehicle carries it."""
    if arm.columns.size == 0:
        raise InputError(f"no joint moves link '{arm.link}', so it cannot be brought to a pose")
    for j, kind in zip(arm.columns.tolist(), arm.tree.kinds(arm.columns), strict=True):
        if kind.wheeled:
            raise InputError(
                f"link '{arm.link}' rides on a vehicle, by its velocity '{arm.velocities[j]}'; "
                "a vehicle has to be driven to a pose, inverse kinematics cannot place it"
            )


def _read_mask(mask: IKMask | None) -> Array:
    """Return the weights (6,) of the rows (v, omega) for a mask."""
    if mask is None or isinstance(mask, str):
        name = "pose" if mask is None else mask
        if name not in IK_MASKS:
            hint = suggest_names(name, IK_MASKS, "masks")
            raise InputError(f"no mask {name!r}; {hint}, or six weights (v, omega)")
        return make_read_only(np.array(IK_MASKS[name], dtype=float))
    weight = as_floats(mask, "mask: weights of (v, omega) in base axes", (6,))
    if weight.ndim > 1 or (weight < 0).any() or not weight.any():
        value = format_value(weight.tolist())
        raise InputError(f"mask: expected six weights not below 0 and not all 0, got {value}")
    weight = weight / weight.max()
    if (weight[weight > 0] < SMALLEST_WEIGHT).any():
        raise InputError(f"mask: a weight is 0, or at least {SMALLEST_WEIGHT:g} of the largest one")
    return make_read_only(weight)


def _make_ik_result(
    results: kernels.SearchResults, solved: NDArray[np.bool_], lead: tuple[int, ...]
) -> IKResult:
    """Return the results as arrays (...), or as numbers for a single pose."""
    reason, iterations, restarts = results.counts
    rows = solved, results.error, iterations, restarts, reason
    q = make_read_only(results.q.reshape(*lead, results.q.shape[1]))
    if lead:
        return IKResult(q, *(make_read_only(array.reshape(lead)) for array in rows))
    success, error, iterations, restarts, reason = (array[0] for array in rows)
    return IKResult(q, success, error, iterations, restarts, IKReason(int(reason)))
