"""The pose of a target whose marks may lie, by reweighted fits."""

from typing import Any

import numpy as np

from robsim.kernels.estimation.m_estimator import put_distances, put_robust_weights
from robsim.kernels.estimation.pose_fit import count_pose_fit_rows as room_of_fit
from robsim.kernels.estimation.pose_fit import fit_pose_stage, reproject_marks
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import any_lane, get, put, sqrt
from robsim.kernels.machine.linked_stages import link_stage
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.kernels.machine.stages import stage

MOST_FITS = 10  # reweighted fits, each from the last one

_linked_fit = link_stage(fit_pose_stage)


def count_robust_fit_rows(N: int) -> int:
    """Return how many rows `fit_robust_pose_stage` needs to work in, for N marks."""
    return 7 * N + 12 + room_of_fit(N)


@part
def _has_changed(w, T, before):
    """Return in which runs a pose is no longer what it was before; keep what it is."""
    moved = get(w, T) < get(w, T)
    for i in range(12):
        now = get(w, T + i)
        moved = moved | ~(now == get(w, before + i))
        put(w, before + i, now)
    return moved


@stage
def fit_robust_pose_stage(
    w,
    step,
    N="count",
    marks="N, 3",
    x="N, 2",
    T="3, 4",
    weights="N",
    room="size",
    kind="whole",
    least="row",
    size="count",
):
    """Refit a pose T to the image x of N marks: (N, marks, x, T, weights, room, kind, least).

    Each fit weighs the squares by how far the marks are from where the last one sees them, in units
    of their scale (see `robsim.kernels.estimation.m_estimator`). After ten fits, or when T does not
    change any more; T and weights are then of one another. It is the minimum to which T leads.
    """
    distances, roots, before = room + 5 * N, room + 6 * N, room + 7 * N
    _has_changed(w, T, before)
    for _ in range(MOST_FITS):
        for n in range(N):
            put(w, roots + n, 1.0)
        reproject_marks(w, marks, N, T, x, roots, room)
        put_distances(w, N, room + 3 * N, distances)
        put_robust_weights(w, kind, N, distances, least, weights)
        for n in range(N):
            put(w, roots + n, sqrt(get(w, weights + n)))
        _linked_fit(w, (N, marks, x, T, T, roots, before + 12))
        if not any_lane(_has_changed(w, T, before)):
            return


def fit_robust_pose(marks: Any, x: Any, T: Any, kind: int, least: float) -> Any:
    """Refit the poses T[3, 4, b] to images x[n, 2, b] of marks[n, 3, b], in place.

    Return the weights [n, b] of the squares.
    """
    N, runs, program = len(x), x.shape[2], Program()
    first, seen = program.rows(N, 3), program.rows(N, 2)
    pose, found = program.rows(3, 4), program.rows(N)
    rows = {"marks": first, "x": seen, "T": pose, "weights": found, "kind": kind}
    room, scale = program.rows(count_robust_fit_rows(N)), program.constant(least)
    program.add(fit_robust_pose_stage, **rows, room=room, least=scale)
    given = np.concatenate([each.reshape(-1, runs) for each in (marks, x, T)])
    made = ProgramFunction(program, first, pose, 12 + N)(given)
    T[:] = made[:12].reshape(T.shape)
    return made[12:]
