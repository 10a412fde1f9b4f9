"""Classification of equilibria by their error and by the eigenvalues of the closed loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.equilibrium import EquilibriumKind
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array, euclidean_length, view_runs_first

SAME_STATE = 1e-5  # distance (m, rad) below which two states are equal
ZERO_EIGENVALUE = 1e-4  # largest zero eigenvalue, relative to the slowest rate of the controller


@dataclass(frozen=True, eq=False)
class EquilibriumPoints:
    """Distinct states without commanded motion, with their errors and eigenvalues."""

    q: Array  # (nq, E)
    error_norm: Array  # (E,)
    zero: NDArray[np.bool_]  # (E,) whether the error is below the tolerance
    eigenvalues: NDArray[np.complex128]  # (n, E)
    free: NDArray[np.int64]  # (E,) number of zero eigenvalues


def merge_points(field: VectorField, q: Array) -> EquilibriumPoints:
    """Return the points at states q (nq, B), with equal states merged."""
    merged, rest = [], q
    while rest.shape[1]:
        merged.append(rest[:, :1])
        rest = rest[:, field.distances(merged[-1], rest)[0] > SAME_STATE]
    q = np.ascontiguousarray(np.concatenate([q[:, :0], *merged], axis=1))
    command = field.command(q)
    zero = np.abs(command.error).max(axis=0) < field.controller.tolerance
    error_norm = euclidean_length(command.s - field.controller.s_goal)
    values = loop_eigenvalues(field, q)
    free = (np.abs(values) < ZERO_EIGENVALUE * field.controller.pace).sum(axis=0)
    return EquilibriumPoints(q, error_norm, zero, values, np.asarray(free))


def loop_eigenvalues(field: VectorField, q: Array) -> NDArray[np.complex128]:
    """Return the eigenvalues (n, E) of df/dq, sorted by real part; NaN if f is not smooth.

    A unicycle has one coordinate more than velocities, which adds an eigenvalue zero.
    """
    ahead, behind = field.differences(q)
    size = np.abs(ahead - behind).max(axis=(0, 1))
    bend = np.abs(ahead + behind - 2.0 * field.rates(q)[:, None]).max(axis=(0, 1))
    smooth = bend <= field.roughness * size
    J = np.where(smooth, (ahead - behind) / (2.0 * field.step), 0.0)
    values = np.linalg.eigvals(view_runs_first(J)).astype(np.complex128)
    values = np.concatenate([values, np.zeros((len(values), field.unactuated))], axis=1)
    values = np.take_along_axis(values, np.lexsort((values.imag, values.real)), axis=1)
    return np.where(smooth, values.T, np.nan)


def group_points(points: EquilibriumPoints) -> NDArray[np.int64]:
    """Return, for each point, the first point (E,) of the set of equilibria that contains it.

    A point without zero eigenvalues is its own set. Along a curve of equilibria L' e = 0, and the
    differential e' L dq of V is zero, so that the norm of the error is constant. Degenerate points
    of one norm are therefore listed once.
    """
    first, norm = np.arange(points.zero.size), points.error_norm
    degenerate = (points.free > 0) | np.isnan(points.eigenvalues).any(axis=0)
    for i in np.flatnonzero(degenerate):
        close = np.abs(norm[:i] - norm[i]) <= SAME_STATE * norm[i]
        same = degenerate[:i] & (close | (points.zero[:i] & points.zero[i]))
        first[i] = np.append(np.flatnonzero(same), i)[0]
    return first


def classify_points(field: VectorField, points: EquilibriumPoints) -> list[EquilibriumKind]:
    """Return the kind of each point."""
    is_elsewhere = np.zeros(points.zero.size, dtype=np.bool_)
    if field.true_goal is not None:
        offset = field.pose(points.q).matrix - field.true_goal.matrix
        is_elsewhere = np.asarray(np.abs(offset).max(axis=(1, 2)) > 10 * SAME_STATE)
    columns = (
        points.zero.tolist(),
        is_elsewhere.tolist(),
        points.free.tolist(),
        points.eigenvalues.T,
    )
    return [_classify_point(*one) for one in zip(*columns, strict=True)]


def _classify_point(
    zero: bool, is_elsewhere: bool, free: int, values: NDArray[np.complex128]
) -> EquilibriumKind:
    """Return the kind of a point from its error, its goal pose and its eigenvalues."""
    if zero:
        return "false goal" if is_elsewhere and not free else "goal"
    if np.isnan(values).any():
        return "not smooth"
    if free:
        return "degenerate"
    grows = (values.real > 0).sum()
    if not grows:
        return "minimum"
    return "source" if grows == values.size else "saddle"
