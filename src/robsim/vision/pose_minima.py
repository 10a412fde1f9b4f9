"""The minima of the reprojection error of a target: starts, refinement, and order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, runs_first, runs_last
from robsim.kernels.estimation.pose import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.image import normalised
from robsim.vision.orthography import mirrored, orthographic_poses
from robsim.vision.three_marks import three_marks_poses

POINT = 1e-12  # normalised: an image of this size or less counts as a point
ASIDE = 1e8  # normalised: points farther from the axis count as missing
SAME = 1e-3  # radians, and relative to the distance: closer minima count as one
EXACT = 1e-6  # pixels: the residual up to which a minimum of three marks counts as exact
CHUNK = 32  # poses that are refined together
ROUNDS = 10  # rounds of 30 updates; a start on the wrong side of a thick far target takes several
ARRIVED = 1e-9  # radians, and relative to the distance: a smaller change ends the refinement


def all_minima(p: Array, u: Array, camera: Camera) -> tuple[Array, Array]:
    """Return the minima T_c_o (B, 4, 3, 4) and sums of squared pixels (B, 4), the best first.

    Of marks p (N, 3) and pixels u (B, N, 2); NaN and inf where an image shows nothing.
    """
    x = normalised(u, camera)
    T, squares = np.full((len(x), 4, 3, 4), np.nan), np.full((len(x), 4), np.inf)
    seen = shows(x)
    with np.errstate(all="ignore"):  # starts that are not finite are replaced
        starts = _starts(p, x[seen])
        T[seen], squares[seen] = minima_from(p, x[seen], u[seen], camera, starts)
    return T, squares


def shows(x: Array) -> NDArray[np.bool_]:
    """Return which images (B) of normalised points (B, N, 2) show something."""
    there = (np.ptp(x, axis=1).max(-1) > POINT) & (np.abs(x).max((1, 2)) < ASIDE)
    return np.asarray(there)  # no NaN


def minima_from(
    p: Array, x: Array, u: Array, camera: Camera, starts: Array, weights: Array | None = None
) -> tuple[Array, Array]:
    """Return the minima T_c_o (B, 4, 3, 4) to which starts (B, k, 3, 4) lead, the best first.

    Also the sums of squared pixels (B, 4), times weights (B, N) if there are any. A start of zeros
    is none.
    """
    T = _refined(p, x, starts, None if weights is None else np.sqrt(weights))
    squares = _squares(p, T, u, camera, weights)
    if len(p) == 3:  # exact poses, or the nearest to one
        exact = squares.min(1, keepdims=True) + 2 * len(p) * EXACT**2
        squares = np.where(squares <= exact, squares, np.inf)
    T, squares = _sorted(T, squares)
    for k in range(1, T.shape[1]):
        again = (apart(T[:, :k], T[:, k, None]) < SAME).any(1)
        squares[again, k] = np.inf
    T, squares = _sorted(T, squares)
    T[np.isinf(squares)] = np.nan
    return T[:, :4], squares[:, :4]


def _starts(p: Array, x: Array) -> Array:
    """Return starts T_c_o (B, k, 3, 4); those that are not finite are replaced by zeros."""
    three = _largest_triangle(p)
    exact = three_marks_poses(p[three], x[:, three])
    if len(p) > 3:
        squares = _or_infinite(np.square(misses(p, exact, x)).sum((-1, -2)))
        best = exact[np.arange(len(x)), squares.argmin(1), None]
        exact = np.concatenate([best, mirrored(p, best)], axis=1)
    poses = np.concatenate([orthographic_poses(p, x), exact], axis=1)
    return np.where(np.isfinite(poses).all((-1, -2), keepdims=True), poses, 0.0)


def _largest_triangle(p: Array) -> NDArray[np.int64]:
    """Return the numbers of two marks farthest apart, and of a third farthest from their line."""
    between = np.linalg.norm(p[:, None] - p, axis=-1)
    i, j = np.unravel_index(between.argmax(), between.shape)
    k = np.linalg.norm(np.cross(p - p[i], p[j] - p[i]), axis=-1).argmax()
    return np.array([i, j, k])


def _refined(p: Array, x: Array, starts: Array, roots: Array | None) -> Array:
    """Return the minima (B, k, 3, 4) to which the starts converge."""
    T = starts.reshape(-1, 3, 4).copy()
    images = np.repeat(x, starts.shape[1], axis=0)
    rows = np.ones(images.shape[:2]) if roots is None else np.repeat(roots, starts.shape[1], axis=0)
    going = np.flatnonzero(T.any((1, 2)))
    for _ in range(ROUNDS):
        moved = _fitted(p, images[going], T[going], rows[going])
        far = apart(moved, T[going]) > ARRIVED  # false where NaN
        T[going], going = moved, going[far]
    return T.reshape(starts.shape)


def _fitted(p: Array, images: Array, guess: Array, roots: Array) -> Array:
    """Return T (n, 3, 4) after at most 30 updates, in chunks so that slow poses delay few."""
    out = np.empty_like(guess)
    for first in range(0, len(images), CHUNK):
        some = slice(first, first + CHUNK)
        start = runs_last(guess[some], 2)
        T, marks = np.empty_like(start), np.repeat(p[..., None], start.shape[2], axis=2)
        fit_pose(marks, runs_last(images[some], 2), start, T, runs_last(roots[some], 1))
        out[some] = runs_first(T)
    return out


def in_camera(p: Array, T: Array) -> Array:
    """Return marks (..., N, 3) in camera axes."""
    return p @ np.swapaxes(T[..., :3], -1, -2) + T[..., None, :, 3]


def misses(p: Array, T: Array, x: Array) -> Array:
    """Return errors (B, k, N, 2) at unit depth; NaN for a mark that is behind the camera."""
    X = in_camera(p, T)
    return X[..., :2] / np.where(X[..., 2:] > 0, X[..., 2:], np.nan) - x[:, None]


def in_image(p: Array, T: Array, camera: Camera) -> Array:
    """Return pixels (B, k, N, 2) of marks from poses (B, k, 3, 4); NaN where behind."""
    pixels, _ = camera.image_of(runs_last(in_camera(p, T), 2))
    return runs_first(pixels, T.shape[:2])


def _squares(p: Array, T: Array, u: Array, camera: Camera, weights: Array | None) -> Array:
    """Return sums (B, k) of weighted squared distances in the image; inf where one is behind."""
    each = np.square(in_image(p, T, camera) - u[:, None])
    if weights is not None:
        each = each * weights[:, None, :, None]
    return _or_infinite(each.sum((-1, -2)))


def _or_infinite(squares: Array) -> Array:
    return np.where(np.isnan(squares), np.inf, squares)


def _sorted(T: Array, squares: Array) -> tuple[Array, Array]:
    """Return poses and squared errors, sorted by error."""
    order, rows = np.argsort(squares, axis=1, kind="stable"), np.arange(len(T))[:, None]
    return T[rows, order], squares[rows, order]


def apart(A: Array, B: Array) -> Array:
    """Return the larger of the rotation (rad) and the relative distance between poses."""
    chord = np.sqrt(np.square(A[..., :3] - B[..., :3]).sum((-1, -2)) / 2)
    shift = np.sqrt(np.square(A[..., 3] - B[..., 3]).sum(-1) / np.square(B[..., 3]).sum(-1))
    return np.asarray(np.maximum(chord, shift))
