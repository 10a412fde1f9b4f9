"""Sides of planes for pieces of faces, and cuts of pieces at planes."""

from typing import Any, NamedTuple

from robsim.kernels.machine.intrinsics import fragment, routine

FIRST, COUNT, SOURCE, FACE_ROWS = 0, 1, 2, 3  # rows of `pieces`
PIECES, CORNERS, GROUPS, TOTALS = 0, 1, 2, 3  # places of `totals`
SPARE = 64  # corners that a face may get by cuts


class PainterPlanes(NamedTuple):
    """The planes of faces turned to the viewer, with areas, numbers of solids and a distance."""

    normals: Any
    offsets: Any
    areas: Any
    body: Any
    near: Any


class PainterPieces(NamedTuple):
    """Pieces of faces, their corners, and whether a side of the face follows each corner."""

    pieces: Any
    corners: Any
    is_side: Any
    totals: Any


@routine
def find_side(planes, pool, p, faces, count):
    """Return 1 for a piece in front of a face, -1 for one behind all faces, and 0 otherwise."""
    first, n = pool.pieces[FIRST, p], pool.pieces[COUNT, p]
    area, near, behind = planes.areas[pool.pieces[SOURCE, p]], planes.near, True
    for k in range(count):
        f = faces[k]
        x, y, z = planes.normals[f, 0], planes.normals[f, 1], planes.normals[f, 2]
        offset = planes.offsets[f]
        low, high = 1e300, -1e300
        for c in range(first, first + n):
            level = _height(pool.corners, c, x, y, z, offset)
            low, high = min(low, level), max(high, level)
        if low >= -near and (high > near or area < planes.areas[f]):
            return 1
        behind = behind and high <= near
    return -1 if behind else 0


@fragment
def _height(corners, c, x, y, z, offset):
    """Return the height of a corner over a plane."""
    return x * corners[c, 0] + y * corners[c, 1] + z * corners[c, 2] - offset


@routine
def find_highest_face(planes, pool, p, faces, count, heights):
    """Return the number of the face that a piece exceeds most, and compute its heights.

    The result is -1 if no face is exceeded, and -2 without room.
    """
    first, n = pool.pieces[FIRST, p], pool.pieces[COUNT, p]
    if n > len(heights):
        return -2
    best, greatest = -1, planes.near
    for k in range(count):
        f = faces[k]
        x, y, z = planes.normals[f, 0], planes.normals[f, 1], planes.normals[f, 2]
        offset = planes.offsets[f]
        for i in range(n):
            level = _height(pool.corners, first + i, x, y, z, offset)
            heights[i, k] = level
            if level > greatest:
                best, greatest = k, level
    return best


@fragment
def is_above(pool, p, k, heights, near):
    """Return whether no corner of a piece is below a plane."""
    low = 1e300
    for i in range(pool.pieces[COUNT, p]):
        low = min(low, heights[i, k])
    return low >= -near


@routine
def cut_piece(pool, p, k, heights):
    """Append the parts of a piece above and below a plane; return whether they have room."""
    first, n, totals = pool.pieces[FIRST, p], pool.pieces[COUNT, p], pool.totals
    if totals[PIECES] + 2 > pool.pieces.shape[1] or totals[CORNERS] + 4 * n > len(pool.corners):
        return False
    for sign in range(2):
        start = totals[CORNERS]
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            level, then = heights[i, k], heights[j, k]
            if sign == 1:
                level, then = -level, -then
            side = pool.is_side[first + i]
            if level >= 0.0:
                _copy_corner(pool, first + i)
                pool.is_side[totals[CORNERS] - 1] = side and (level > 0.0 or then > 0.0)
            if level * then < 0.0:
                _append_crossing(pool, first + i, first + j, level / (level - then))
                pool.is_side[totals[CORNERS] - 1] = side and then > 0.0
        piece = totals[PIECES]
        pool.pieces[FIRST, piece], pool.pieces[COUNT, piece] = start, totals[CORNERS] - start
        pool.pieces[SOURCE, piece] = pool.pieces[SOURCE, p]
        totals[PIECES] = piece + 1
    return True


@fragment
def _copy_corner(pool, c):
    """Append a corner to the corners."""
    for i in range(3):
        pool.corners[pool.totals[CORNERS], i] = pool.corners[c, i]
    pool.totals[CORNERS] += 1


@fragment
def _append_crossing(pool, c, d, share):
    """Append the point that divides a side from corner c to d."""
    for i in range(3):
        a, b = pool.corners[c, i], pool.corners[d, i]
        pool.corners[pool.totals[CORNERS], i] = a + share * (b - a)
    pool.totals[CORNERS] += 1
