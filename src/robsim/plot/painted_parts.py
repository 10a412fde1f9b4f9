"""Paths of painted faces: the faces, and the edges of faces that were cut as lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.path import Path
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot.face_order import PaintedFaces
from robsim.plot.polygons import Indices, expand_ranges, grow_polygons, list_following

FACE, LINE, UPRIGHT, KINDS = 0, 1, 2, 3  # kinds of parts
STRAIGHT = 1e-5  # points: largest difference between the columns of an upright line

_Mask = NDArray[np.bool_]


class PaintedParts(NamedTuple):
    """Paths of faces and lines, in the order of painting.

    Attributes
    ----------
    starts, counts : array of int, shape (P,)
        First corner of each painted face, and number of its corners.
    is_grown : array of bool, shape (P,)
        Whether a face has no edge of its own, and is therefore painted larger.
    lines : array of int, shape (L, 2)
        Corners of the lines.
    corners, codes : array of shape (V,)
        For each corner of the paths, its code, and its index among the corners of the grown faces
        and of the lines.
    ends, sources : array of int, shape (M,)
        End of each path, and its face.
    is_line, is_lined : array of bool, shape (M,)
        Whether a path consists of lines, and whether it has a dark edge, as lines have.
    """

    starts: Indices
    counts: Indices
    is_grown: _Mask
    lines: Indices
    corners: Indices
    codes: NDArray[np.uint8]
    ends: Indices
    sources: Indices
    is_line: _Mask
    is_lined: _Mask

    def place_corners(self, corners: Array, width: float) -> Array:
        """Return the corners (V, 2) of the paths for corners (N, 2) of the painted faces."""
        widths = np.where(self.is_grown, width, 0.0).repeat(self.counts)
        grown = grow_polygons(corners, self.starts, self.counts, widths)
        return np.asarray(np.concatenate([grown, corners[self.lines.ravel()]])[self.corners])


def list_painted_parts(
    painted: PaintedFaces, corners: Array, has_border: _Mask, solids: Indices
) -> PaintedParts:
    """Return the paths of painted faces; in each group the lines are after the faces.

    `corners` (N, 2) are the corners on the paper in points. `has_border` (F,) is whether all sides
    of a face are edges, and `solids` (F,) are the numbers of the solids. Consecutive parts of one
    face are one path, as are the lines of one solid. Upright lines are apart, because Matplotlib
    moves a path to whole pixels only if all its lines are upright or level.
    """
    starts = np.cumsum(painted.counts) - painted.counts
    is_whole, lines, owner = _find_lines(painted, starts, has_border)
    is_upright = abs(corners[lines[:, 0], 0] - corners[lines[:, 1], 0]) < STRAIGHT
    kinds = np.concatenate([np.full(len(starts), FACE), np.where(is_upright, UPRIGHT, LINE)])
    groups, sources = painted.groups[owner], painted.sources[owner]
    order = np.argsort(KINDS * groups + kinds, kind="stable")
    looks = np.where(kinds == FACE, sources, -KINDS * solids[sources] - kinds)
    changes = (np.diff(groups[order]) != 0) | (np.diff(looks[order]) != 0)
    last = np.append(changes, True)
    path_corners, codes, sizes = _list_path_corners(painted.counts, len(lines))
    places = expand_ranges((np.cumsum(sizes) - sizes)[order], sizes[order])
    ends, shown = np.cumsum(sizes[order])[last], order[last]
    faces = starts, painted.counts, ~is_whole, lines
    is_line = kinds[shown] != FACE
    is_lined = is_line | is_whole[owner[shown]]
    return PaintedParts(
        *faces, path_corners[places], codes[places], ends, sources[shown], is_line, is_lined
    )


def _find_lines(
    painted: PaintedFaces, starts: Indices, has_border: _Mask
) -> tuple[_Mask, Indices, Indices]:
    """Return whether all sides of each face are edges, and the edges of the other faces as lines.

    The lines are (L, 2) corners, and the last result is the index of the face of each part: of all
    faces, and then of the lines.
    """
    bordered = has_border[painted.sources]
    is_whole = bordered & np.logical_and.reduceat(painted.is_side, starts)
    faces = np.arange(len(starts))
    owner = np.repeat(faces, painted.counts)  # of each corner
    side = np.flatnonzero(painted.is_side & (bordered & ~is_whole)[owner])
    lines = np.column_stack([side, list_following(starts, painted.counts)[side]])
    return is_whole, lines, np.concatenate([faces, owner[side]])


def _list_path_corners(counts: Indices, lines: int) -> tuple[Indices, NDArray[np.uint8], Indices]:
    """Return corners and codes of closed faces and then of lines, and the corners of each.

    A face with n corners, which is grown, has 2 n corners and its first corner again.
    """
    sizes = np.concatenate([2 * counts + 1, np.full(lines, 2)])
    ends = np.cumsum(sizes)
    closed = ends[: len(counts)] - 1
    codes = np.full(int(sizes.sum()), Path.LINETO, np.uint8)
    codes[ends - sizes], codes[closed] = Path.MOVETO, Path.CLOSEPOLY
    corners = np.arange(len(codes)) - np.searchsorted(closed, np.arange(len(codes)))
    corners[closed] = 2 * (np.cumsum(counts) - counts)
    return corners, codes, sizes
