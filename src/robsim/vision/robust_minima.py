"""Robust poses of a target with mismatched marks: starts, and robust weights."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_first, move_runs_last
from robsim.kernels.estimation import m_estimator
from robsim.kernels.estimation.robust_pose_fit import fit_robust_pose
from robsim.vision.camera import Camera
from robsim.vision.p3p import three_marks_poses
from robsim.vision.pixel_measurement import normalise_pixels
from robsim.vision.pose_minima import (
    ARRIVED,
    ROUNDS,
    find_minima,
    is_usable_image,
    pose_distance,
    refine_minima,
    reprojection_errors,
)

WEIGHT_KINDS = {
    "huber": m_estimator.HUBER,
    "tukey": m_estimator.TUKEY,
    "cauchy": m_estimator.CAUCHY,
}
LEAST_MARKS = 5  # any three of four marks have a pose that fits them, so each may be the outlier
EXACT = 1e-9  # pixels: the smallest scale of distances
TRIANGLES = 35  # triangles of marks; with half outliers 1 image in 100 has no triangle of inliers
# steps of a quasi-random sequence: x^-1, x^-2 and x^-3 with x^4 = x + 1 (Roberts 2018)
STEPS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)


def find_robust_minima(
    p: Array, u: Array, camera: Camera, kind: int, noise: float | None
) -> tuple[Array, Array, Array]:
    """Return the minima T_c_o (B, 4, 3, 4), their weighted squares (B, 4), and weights (B, N).

    The arguments are marks p (N, 3) and pixels u (B, N, 2). Iteratively reweighted least squares
    start from the minima of all marks, and from the pose of three marks with the smallest majority
    distance, see `_majority_distances` (least median of squares: Rousseeuw 1984). The weights
    belong to the refined pose with the smallest majority distance.
    """
    x, (T, squares) = normalise_pixels(u, camera), find_minima(p, u, camera)
    weights, seen = np.full(u.shape[:2], np.nan), np.flatnonzero(is_usable_image(x))
    least = max(noise or 0.0, EXACT) / np.sqrt(camera.K[0, 0] * camera.K[1, 1])
    with np.errstate(all="ignore"):  # starts that are not finite are replaced
        starts = np.concatenate([T[seen], _best_triangle_poses(p, x[seen])], axis=1)
        refined, each = _reweight_minima(p, x[seen], starts, kind, float(least))
        best, runs = _majority_distances(p, refined, x[seen]).argmin(1), np.arange(len(seen))
        weights[seen] = each[runs, best]
        T[seen], squares[seen] = refine_minima(
            p, x[seen], u[seen], camera, np.nan_to_num(refined), weights[seen]
        )
    return T, squares, weights


def _select_triangles(N: int) -> NDArray[np.int64]:
    """Return the marks (n, 3) of triangles: all triangles, or an even selection of TRIANGLES."""
    if N <= 7:
        return np.array(list(combinations(range(N), 3)))
    indices = (np.arange(1, 4 * TRIANGLES)[:, None] * STEPS % 1.0 * N).astype(np.int64)
    three = np.sort(indices, axis=1)
    return three[(np.diff(three, axis=1) > 0).all(1)][:TRIANGLES]


def _best_triangle_poses(p: Array, x: Array) -> Array:
    """Return the pose (B, 1, 3, 4) of three marks with the smallest majority distance."""
    poses = [three_marks_poses(p[three], x[:, three]) for three in _select_triangles(len(p))]
    each = np.concatenate(poses, axis=1)
    best = _majority_distances(p, each, x).argmin(1)
    return np.asarray(each[np.arange(len(x)), best, None])


def _majority_distances(p: Array, T: Array, x: Array) -> Array:
    """Return the majority distances (B, k) of poses T (B, k, 3, 4); inf if a pose is not finite.

    The majority distance of a pose is the (N // 2 + 2)-th smallest of its reprojection errors. It
    counts more than half of the marks, because a pose of three marks fits these marks exactly.
    """
    distances = np.linalg.norm(reprojection_errors(p, T, x), axis=-1)
    within = np.sort(distances, axis=-1)[..., len(p) // 2 + 1]  # NaN come last
    return np.where(np.isfinite(distances).all(-1), within, np.inf)


def _reweight_minima(
    p: Array, x: Array, starts: Array, kind: int, least: float
) -> tuple[Array, Array]:
    """Return the minima (B, k, 3, 4) reached from the starts, and the weights (B, k, N) there."""
    B, k = starts.shape[:2]
    T = move_runs_last(starts.reshape(-1, 3, 4), 2)
    images = move_runs_last(np.repeat(x, k, axis=0), 2)
    marks, weights = np.repeat(p[..., None], B * k, axis=2), np.empty((len(p), B * k))
    active = np.flatnonzero(np.isfinite(T).all((0, 1)))
    for _ in range(ROUNDS):
        if not active.size:
            break
        updated = np.ascontiguousarray(T[..., active])
        weights[:, active] = fit_robust_pose(
            marks[..., active], images[..., active], updated, kind, least
        )
        change = pose_distance(move_runs_first(updated), move_runs_first(T[..., active]))
        far = change > ARRIVED  # false for NaN
        T[..., active], active = updated, active[far]
    return move_runs_first(T).reshape(B, k, 3, 4), move_runs_first(weights).reshape(B, k, len(p))
