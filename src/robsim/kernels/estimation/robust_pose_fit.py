"""Robust fit of a target's pose to marks with outliers, by reweighted least squares."""

from typing import Any

import numpy as np

from robsim.kernels.estimation.m_estimator import put_distances, put_robust_weights
from robsim.kernels.estimation.pose_fit import count_pose_fit_rows as room_of_fit
from robsim.kernels.estimation.pose_fit import fit_pose_stage, reproject_marks
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import any_lane, get, put, sqrt
from robsim.kernels.machine.linked_stages import link_stage
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.kernels.machine.stages import stage

MOST_FITS = 10  # most reweighted fits, each from the pose of the last fit

_linked_fit = link_stage(fit_pose_stage)


def count_robust_fit_rows(N: int) -> int:
    """Return the number of scratch rows that `fit_robust_pose_stage` needs for N marks."""
    return 7 * N + 12 + room_of_fit(N)


@part
def _has_changed(w, T, before):
    """Return the mask of runs with a pose T that differs from `before`, and copy T to `before`."""
    changed = get(w, T) < get(w, T)
    for i in range(12):
        now = get(w, T + i)
        changed = changed | ~(now == get(w, before + i))
        put(w, before + i, now)
    return changed


@stage
def fit_robust_pose_stage(
    w,
    step,
    N="count",
    marks="N, 3",
    x="N, 2",
    T="3, 4",
    weights="N",
    scratch="size",
    kind="whole",
    least_scale="row",
    size="count",
):
    """Refit a pose T to the image points x of N marks by an M-estimator.

    Each fit weights the squares by the distances of the marks from their points at the last pose,
    in units of the scale (see `robsim.kernels.estimation.m_estimator`). The iteration ends after
    ten fits, or if T does not change; T and the weights are then consistent. The result is the
    local minimum near the initial T.
    """
    distances, roots, before = scratch + 5 * N, scratch + 6 * N, scratch + 7 * N
    _has_changed(w, T, before)
    for _ in range(MOST_FITS):
        for n in range(N):
            put(w, roots + n, 1.0)
        reproject_marks(w, marks, N, T, x, roots, scratch)
        put_distances(w, N, scratch + 3 * N, distances)
        put_robust_weights(w, kind, N, distances, least_scale, weights)
        for n in range(N):
            put(w, roots + n, sqrt(get(w, weights + n)))
        _linked_fit(w, (N, marks, x, T, T, roots, before + 12))
        if not any_lane(_has_changed(w, T, before)):
            return


def fit_robust_pose(marks: Any, x: Any, T: Any, kind: int, least_scale: float) -> Any:
    """Refit the poses T[3, 4, b] to images x[n, 2, b] of marks[n, 3, b], in place.

    Return the weights [n, b] of the squared distances.
    """
    N, runs, program = len(x), x.shape[2], Program()
    first, points = program.rows(N, 3), program.rows(N, 2)
    pose, weights = program.rows(3, 4), program.rows(N)
    rows = {"marks": first, "x": points, "T": pose, "weights": weights, "kind": kind}
    room, scale = program.rows(count_robust_fit_rows(N)), program.constant(least_scale)
    program.add(fit_robust_pose_stage, **rows, scratch=room, least_scale=scale)
    arrays = np.concatenate([each.reshape(-1, runs) for each in (marks, x, T)])
    results = ProgramFunction(program, first, pose, 12 + N)(arrays)
    T[:] = results[:12].reshape(T.shape)
    return results[12:]
