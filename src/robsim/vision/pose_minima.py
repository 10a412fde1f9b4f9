"""The minima of the reprojection error of a target, refined from several starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_first, move_runs_last
from robsim.kernels.estimation.pose_fit import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.orthography import mirror_pose, orthographic_poses
from robsim.vision.p3p import three_marks_poses
from robsim.vision.pixel_measurement import normalise_pixels

POINT = 1e-12  # normalised: an image of this size or less counts as a point
ASIDE = 1e8  # normalised: points farther from the optical axis count as missing
SAME = 1e-3  # radians, and relative to the distance: closer minima count as one
EXACT = 1e-6  # pixels: minima of three marks with at most this residual count as exact
CHUNK = 32  # poses refined together
ROUNDS = 10  # rounds of 30 updates; a start on the wrong side of a thick far target needs several
ARRIVED = 1e-9  # radians, and relative to the distance: a smaller change ends the refinement


def find_minima(p: Array, u: Array, camera: Camera) -> tuple[Array, Array]:
    """Return the minima T_c_o (B, 4, 3, 4) and sums of squared pixels (B, 4), the best first.

    The arguments are marks p (N, 3) and pixels u (B, N, 2). Missing minima have the pose NaN and
    the sum inf.
    """
    x = normalise_pixels(u, camera)
    T, squares = np.full((len(x), 4, 3, 4), np.nan), np.full((len(x), 4), np.inf)
    seen = is_usable_image(x)
    with np.errstate(all="ignore"):  # starts that are not finite are replaced
        starts = _start_poses(p, x[seen])
        T[seen], squares[seen] = refine_minima(p, x[seen], u[seen], camera, starts)
    return T, squares


def is_usable_image(x: Array) -> NDArray[np.bool_]:
    """Return whether images (B,) of normalised points (B, N, 2) are finite and not a point."""
    usable = (np.ptp(x, axis=1).max(-1) > POINT) & (np.abs(x).max((1, 2)) < ASIDE)
    return np.asarray(usable)  # false for NaN


def refine_minima(
    p: Array, x: Array, u: Array, camera: Camera, starts: Array, weights: Array | None = None
) -> tuple[Array, Array]:
    """Return the minima T_c_o (B, 4, 3, 4) reached from starts (B, k, 3, 4), the best first.

    The second result contains the sums (B, 4) of squared pixels, weighted by `weights` (B, N) if
    they are not None. A start of zeros is skipped.
    """
    T = _iterate_poses(p, x, starts, None if weights is None else np.sqrt(weights))
    squares = _squared_errors(p, T, u, camera, weights)
    if len(p) == 3:  # exact poses, or the pose with the smallest error
        exact = squares.min(1, keepdims=True) + 2 * len(p) * EXACT**2
        squares = np.where(squares <= exact, squares, np.inf)
    T, squares = _sort_minima(T, squares)
    for k in range(1, T.shape[1]):
        again = (pose_distance(T[:, :k], T[:, k, None]) < SAME).any(1)
        squares[again, k] = np.inf
    T, squares = _sort_minima(T, squares)
    T[np.isinf(squares)] = np.nan
    return T[:, :4], squares[:, :4]


def _start_poses(p: Array, x: Array) -> Array:
    """Return starts T_c_o (B, k, 3, 4); starts that are not finite are replaced by zeros."""
    three = _largest_triangle(p)
    exact = three_marks_poses(p[three], x[:, three])
    if len(p) > 3:
        squares = _nan_to_infinity(np.square(reprojection_errors(p, exact, x)).sum((-1, -2)))
        best = exact[np.arange(len(x)), squares.argmin(1), None]
        exact = np.concatenate([best, mirror_pose(p, best)], axis=1)
    poses = np.concatenate([orthographic_poses(p, x), exact], axis=1)
    return np.where(np.isfinite(poses).all((-1, -2), keepdims=True), poses, 0.0)


def _largest_triangle(p: Array) -> NDArray[np.int64]:
    """Return the indices of the two marks farthest apart, and of the farthest from their line."""
    between = np.linalg.norm(p[:, None] - p, axis=-1)
    i, j = np.unravel_index(between.argmax(), between.shape)
    k = np.linalg.norm(np.cross(p - p[i], p[j] - p[i]), axis=-1).argmax()
    return np.array([i, j, k])


def _iterate_poses(p: Array, x: Array, starts: Array, roots: Array | None) -> Array:
    """Return the minima (B, k, 3, 4) reached from the starts."""
    T = starts.reshape(-1, 3, 4).copy()
    images = np.repeat(x, starts.shape[1], axis=0)
    rows = np.ones(images.shape[:2]) if roots is None else np.repeat(roots, starts.shape[1], axis=0)
    active = np.flatnonzero(T.any((1, 2)))
    for _ in range(ROUNDS):
        updated = _fit_in_chunks(p, images[active], T[active], rows[active])
        far = pose_distance(updated, T[active]) > ARRIVED  # false for NaN
        T[active], active = updated, active[far]
    return T.reshape(starts.shape)


def _fit_in_chunks(p: Array, images: Array, guess: Array, roots: Array) -> Array:
    """Return T (n, 3, 4) after at most 30 updates; small chunks confine the slow poses."""
    out = np.empty_like(guess)
    for first in range(0, len(images), CHUNK):
        chunk = slice(first, first + CHUNK)
        start = move_runs_last(guess[chunk], 2)
        T, marks = np.empty_like(start), np.repeat(p[..., None], start.shape[2], axis=2)
        fit_pose(marks, move_runs_last(images[chunk], 2), start, T, move_runs_last(roots[chunk], 1))
        out[chunk] = move_runs_first(T)
    return out


def transform_marks(p: Array, T: Array) -> Array:
    """Return marks (..., N, 3) in camera axes."""
    return p @ np.swapaxes(T[..., :3], -1, -2) + T[..., None, :, 3]


def reprojection_errors(p: Array, T: Array, x: Array) -> Array:
    """Return errors (B, k, N, 2) at unit depth; NaN for a mark behind the camera."""
    X = transform_marks(p, T)
    return X[..., :2] / np.where(X[..., 2:] > 0, X[..., 2:], np.nan) - x[:, None]


def project_marks(p: Array, T: Array, camera: Camera) -> Array:
    """Return pixels (B, k, N, 2) of marks for poses (B, k, 3, 4); NaN behind the camera."""
    pixels, _ = camera.image_of(move_runs_last(transform_marks(p, T), 2))
    return move_runs_first(pixels, T.shape[:2])


def _squared_errors(p: Array, T: Array, u: Array, camera: Camera, weights: Array | None) -> Array:
    """Return sums (B, k) of weighted squared distances in the image; inf for a mark behind."""
    each = np.square(project_marks(p, T, camera) - u[:, None])
    if weights is not None:
        each = each * weights[:, None, :, None]
    return _nan_to_infinity(each.sum((-1, -2)))


def _nan_to_infinity(squares: Array) -> Array:
    """Return squares with inf instead of NaN."""
    return np.where(np.isnan(squares), np.inf, squares)


def _sort_minima(T: Array, squares: Array) -> tuple[Array, Array]:
    """Return poses and squared errors in the order of the errors."""
    order, rows = np.argsort(squares, axis=1, kind="stable"), np.arange(len(T))[:, None]
    return T[rows, order], squares[rows, order]


def pose_distance(A: Array, B: Array) -> Array:
    """Return the larger of the rotation (rad) and the relative distance between poses."""
    chord = np.sqrt(np.square(A[..., :3] - B[..., :3]).sum((-1, -2)) / 2)
    shift = np.sqrt(np.square(A[..., 3] - B[..., 3]).sum(-1) / np.square(B[..., 3]).sum(-1))
    return np.asarray(np.maximum(chord, shift))
