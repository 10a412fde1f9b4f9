"""The inner corners of a board from its tags, each followed from its last place."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.geometry.pose import IDENTITY
from robsim.kernels.detection.square_edges import follow_squares
from robsim.vision.camera import Camera
from robsim.vision.detectors.mark_detector import MarkSearch, Picture
from robsim.vision.plane import append_one, estimate_homography, map_points
from robsim.vision.tags.board import Board
from robsim.vision.tags.tag_families import find_tag_family

FEWEST = 3  # squares on a side, for four inner corners that are not on one line
LEAST_MARGIN = 0.6  # cells of white around a tag, whose colour is compared
SAME = 2.0  # pixels: last places that are closer to a homography agree with it
SEED, SAMPLES = 31, 64  # of four last places each, if some of them are old


def check_board(board: Board) -> None:
    """Raise InputError for a board whose tags cannot be followed."""
    if min(board.columns, board.rows) < FEWEST:
        raise InputError(
            f"TagTracker needs a board of {FEWEST} x {FEWEST} squares or more, and the board has "
            f"{board.columns} x {board.rows}"
        )
    margin = 0.5 * (board.square - board.tag) / (board.tag / find_tag_family(board.family).cells)
    if margin < LEAST_MARGIN:
        raise InputError(
            f"TagTracker needs {LEAST_MARGIN:g} white cells or more around the tags of a board, "
            f"which has {margin:.2g}"
        )


def follow_board(
    grey: Picture, search: MarkSearch, patterns: NDArray[np.bool_], most_wrong: int, reach: float
) -> Array:
    """Return the inner corners (N, 2) of a board in one picture (h, w), NaN if not found.

    The last places of the corners yield those of the tags. Tags that are missed are searched again
    at the places that follow from the others. A corner is found if one of its two tags is. It is
    the image of a homography from the corners of these tags, without the lens.
    """
    board = search.target
    assert isinstance(board, Board)
    outlines, found = board.tag_corners, np.full((len(patterns), 4, 2), np.nan)
    H = _fit_last_places(search.marks[:, :2], search.last[0])
    for _ in range(2):
        missed = np.isnan(found[:, 0, 0])
        last = map_points(H, outlines[missed].reshape(-1, 2)).reshape(1, -1, 4, 2)
        seen = np.empty(last.shape)
        follow_squares(grey[None], last, patterns[missed], most_wrong, reach, seen)
        found[missed] = seen[0]
        is_seen = np.isfinite(found[:, 0, 0])
        if is_seen.all() or not is_seen.any():
            break
        H = estimate_homography(outlines[is_seen].reshape(-1, 2), found[is_seen].reshape(-1, 2))
    return _find_inner_corners(board, search.marks, search.camera, found)


def _fit_last_places(points: Array, last: Array) -> Array:
    """Return the homography (3, 3) of most last places (N, 2); some of them may be old."""
    known = np.isfinite(last[:, 0])
    if known.sum() < 4:
        return np.full((3, 3), np.nan)
    points, last = points[known], last[known]
    H = estimate_homography(points, last)
    if np.linalg.norm(map_points(H, points) - last, axis=1).max() < SAME:
        return H
    random = np.random.default_rng(SEED)
    samples = np.array([random.permutation(len(points))[:4] for _ in range(SAMPLES)])
    each = estimate_homography(points[samples], last[samples])
    apart = np.linalg.norm(map_points(each, points) - last, axis=-1)
    sizes = np.nan_to_num(apart, nan=np.inf)
    best = sizes[np.median(sizes, axis=1).argmin()] < SAME
    return estimate_homography(points[best], last[best]) if best.sum() >= 4 else H


def _find_inner_corners(board: Board, marks: Array, camera: Camera, found: Array) -> Array:
    """Return the inner corners (N, 2) from the corners (T, 4, 2) of the tags that are found."""
    tags = _list_neighbours(board)
    seen = np.isfinite(found[:, 0, 0])[tags]
    one = np.where(seen[:, 0], tags[:, 0], tags[:, 1])  # the tag that is seen counts twice
    two = np.where(seen[:, 1], tags[:, 1], tags[:, 0])
    out, near = np.full((len(marks), 2), np.nan), seen.any(axis=1)
    if not near.any():
        return out
    pairs = np.stack([one, two], axis=1)[near]
    rays = np.full(found.shape, np.nan)
    whole = np.isfinite(found[:, 0, 0])
    rays[whole] = camera.normalise(found[whole])
    outlines = board.tag_corners[pairs].reshape(len(pairs), 8, 2)
    H = estimate_homography(outlines, rays[pairs].reshape(len(pairs), 8, 2))
    ideal = map_points(H, marks[near, None, :2])[:, 0]
    out[near] = camera.project(append_one(ideal), IDENTITY)
    return out


@lru_cache(16)
def _list_neighbours(board: Board) -> NDArray[np.int64]:
    """Return the numbers (N, 2) of the two tags that touch each inner corner."""
    middles = board.tag_corners.mean(axis=1)
    apart = np.linalg.norm(board.marks[:, None, :2] - middles, axis=-1)
    return make_read_only(np.argsort(apart, axis=1, kind="stable")[:, :2])
