"""First-order stability of a closed loop at many instants."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.state_history import select_instants
from robsim.base.arrays import Array
from robsim.base.value import replace_unchecked
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import RCOND
from robsim.servo.laws.law import CameraLaw, JointLaw, Law

WINDOW = 1000  # instants that are computed together, which limits the memory


class LoopStability(NamedTuple):
    """Measures (T,) of stability at T instants; NaN where they are unknown."""

    stability: Array
    stability_motion: Array
    contraction: Array


def measure_stability(
    law: Law, state: ControlState, L: Array, task_jacobian: Array, dt: float
) -> LoopStability:
    """Return the stability of a loop from its law and state, and the true L and L J.

    L (T, k, 6) and L J (T, k, n) are multiplied by the weights of the law. The measures of motions
    are known for a `JointLaw` and a `CameraLaw` only.
    """
    measures = LoopStability(*np.full((3, len(L)), np.nan))
    linear = type(law) in (JointLaw, CameraLaw)
    for some in _list_finite_windows(state, L, task_jacobian):
        at = select_instants(state, some)
        # the law of a robot with velocities that are the twist of the camera
        eye = np.repeat(np.eye(6)[..., None], len(some), axis=-1)
        twist = replace_unchecked(at, task_jacobian_last=at.interaction_last, jacobian_last=eye)
        measures.stability[some] = smallest_eigenvalues(L[some] @ -law_matrices(JointLaw(), twist))
        if linear:
            gains = np.broadcast_to(np.ravel(at.gain), len(some))
            motions = measure_motions(-law_matrices(law, at), task_jacobian[some], gains * dt)
            measures.stability_motion[some], measures.contraction[some] = motions
    return measures


def _list_finite_windows(
    state: ControlState, L: Array, task_jacobian: Array
) -> Iterator[NDArray[np.int64]]:
    """Yield the indices of the instants with finite matrices, some at a time."""
    used = (np.moveaxis(each, -1, 0) for each in (state.interaction_last, state.task_jacobian_last))
    finite = np.ones(len(L), dtype=bool)
    for each in (L, task_jacobian, *used):
        finite &= np.isfinite(each).all(axis=(1, 2))
    instants = np.flatnonzero(finite)
    for start in range(0, len(instants), WINDOW):
        yield instants[start : start + WINDOW]


def law_matrices(law: Law, state: ControlState) -> Array:
    """Return the matrices (T, n, k) of a law that is linear in the error, at gain 1."""
    k, T = state.error_last.shape

    def wide(array: Array) -> Array:
        return np.ascontiguousarray(np.repeat(array, k, axis=-1))

    unit = replace_unchecked(
        state,
        error_last=np.tile(np.eye(k), T),
        interaction_last=wide(state.interaction_last),
        jacobian_last=wide(state.jacobian_last),
        task_jacobian_last=wide(state.task_jacobian_last),
        gain=1.0,
        s_last=None,  # unused by a law that is linear in the error
        q_last=None,
    )
    commands = law.command(unit).reshape(T, k, -1)
    return np.ascontiguousarray(np.swapaxes(commands, 1, 2))


def measure_motions(P: Array, task_jacobian: Array, gain_dt: Array) -> tuple[Array, Array]:
    """Return stability and contraction (T,) over the commanded motions, the ranges of P (T, n, k).

    Within these motions, one period multiplies a displacement by I - gain dt P L J.
    """
    U, sigma, _ = np.linalg.svd(P, full_matrices=False)
    ranks = (sigma > RCOND * sigma.max(axis=1, initial=0.0, keepdims=True)).sum(axis=1)
    least, radius = np.empty((2, len(P)))
    for rank in np.unique(ranks):
        some = np.flatnonzero(ranks == rank)
        basis = U[some, :, :rank]
        M = np.swapaxes(basis, 1, 2) @ P[some] @ task_jacobian[some] @ basis
        least[some] = smallest_eigenvalues(M)
        eigenvalues = np.linalg.eigvals(np.eye(rank) - gain_dt[some, None, None] * M)
        radius[some] = np.abs(eigenvalues).max(axis=1, initial=0.0)
    return least, radius


def smallest_eigenvalues(M: Array) -> Array:
    """Return the smallest eigenvalue (T,) of the symmetric parts of M (T, n, n)."""
    least: Array = np.linalg.eigvalsh(0.5 * (M + np.swapaxes(M, 1, 2))).min(axis=1, initial=np.inf)
    return least
