"""Faces in the order of the painter, split where they intersect; see `robsim.plot.face_order`."""

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import fragment, routine
from robsim.kernels.raster.hidden_pieces import PainterSolids, is_hidden
from robsim.kernels.raster.piece_cuts import (
    GROUPS,
    PIECES,
    SOURCE,
    PainterPieces,
    PainterPlanes,
    cut_piece,
    find_highest_face,
    find_side,
    is_above,
)

STACK, NEAR, OWN, FAR, ORDER, LIST_ROWS = 0, 1, 2, 3, 4, 5  # rows of `lists`
SET_END, GROUP_END, IS_SORTED, SET_ROWS = 0, 1, 2, 3  # rows of `sets`


@entry(
    "float64[:, ::1], float64[::1], float64[::1], int64[::1], float64, int64[::1], float64[:, "
    "::1], float64[::1], float64[::1], float64, int64[::1], out int64[:, ::1], out float64[:, "
    "::1], out bool[::1], out int64[::1], out int64[:, ::1], out int64[:, ::1], out int64[::1], "
    "out float64[:, ::1], out int64[::1] -> bool"
)
def arrange_faces(
    normals,
    offsets,
    areas,
    body,
    near,
    first,
    balls,
    sides,
    viewer,
    margin,
    rank,
    pieces,
    corners,
    is_side,
    totals,
    lists,
    sets,
    present,
    heights,
    faces,
):
    """Order pieces of faces, the farthest first; return whether the arrays have enough room.

    Pieces that a single convex solid hides are left out.

    Parameters
    ----------
    normals, offsets : array of shape (F, 3) and (F,)
        Planes of the faces; the viewer is in front of the visible ones.
    areas : array of shape (F,)
        Areas, up to a factor.
    body : array of int, shape (F,)
        Solid of each face.
    near : float
        Largest distance of a corner in a plane from it.
    first : array of int, shape (bodies + 1,)
        First face of each solid, and the number of faces.
    balls : array of shape (bodies, 4)
        Centre and radius of a ball around each solid; the radius is -1 if the solid hides nothing.
    sides : array of shape (F,)
        Heights of the viewer over the faces, negative for a face turned away.
    viewer : array of shape (4,)
        Viewer in homogeneous coordinates.
    margin : float
        Distance from the surface of a solid from which it hides pieces.
    rank : array of int, shape (bodies,)
        Places of the convex solids in the order of depth; -1 for other solids.
    pieces : array of int, shape (3, room)
        First corner, number of corners and face of each piece; the visible faces at first.
    corners, is_side : array of shape (room, 3) and (room,)
        Corners, and whether a side of the face follows each of them.
    totals : array of int, shape (3,)
        Numbers of pieces, of corners, and of groups.
    lists : array of int, shape (5, room)
        Lists of pieces; the last row is the order.
    sets : array of int, shape (3, room)
        Ends of sets and of groups in the order, and whether the pieces of a group are in order.
    present, heights, faces : array of shape (bodies,), (corners of a piece, F) and (F,)
        Working memory.
    """
    planes = PainterPlanes(normals, offsets, areas, body, near)
    solids = PainterSolids(first, balls, sides, viewer, margin)
    pool = PainterPieces(pieces, corners, is_side, totals)
    stack, done, depth = lists[STACK], 0, 1
    sets[SET_END, 0] = 0
    whole = totals[PIECES]
    for p in range(whole):
        if not is_hidden(planes, solids, pool, p):
            stack[sets[SET_END, 0]] = p
            sets[SET_END, 0] += 1
    while depth > 0:
        depth -= 1
        begin = sets[SET_END, depth - 1] if depth > 0 else 0
        end = sets[SET_END, depth]
        if begin == end:
            continue
        chosen = _choose_body(planes, pool, rank, stack, begin, end, present)
        own = _take_body(planes, pool, chosen, begin, end, lists)
        if chosen < 0 or own == end - begin:
            end = _drop_hidden_pieces(planes, solids, pool, whole, stack, begin, end)
            done = _emit_group(stack, begin, end, chosen >= 0, done, lists[ORDER], sets, totals)
            continue
        count = _list_faces(pool, lists[OWN], own, faces)
        sizes = _separate(planes, pool, chosen, begin, end, lists, faces, count, heights)
        if sizes[0] < 0 or begin + sizes[0] + own + sizes[1] > lists.shape[1]:
            return False
        begin = _push_set(stack, begin, lists[NEAR], sizes[0], sets, depth)
        begin = _push_set(stack, begin, lists[OWN], own, sets, depth + 1)
        begin = _push_set(stack, begin, lists[FAR], sizes[1], sets, depth + 2)
        depth += 3
        if depth + 3 > sets.shape[1]:
            return False
    return True


@fragment
def _push_set(stack, begin, pieces, count, sets, depth):
    """Copy a set of pieces to the stack, and return its end."""
    for i in range(count):
        stack[begin + i] = pieces[i]
    sets[SET_END, depth] = begin + count
    return begin + count


@fragment
def _drop_hidden_pieces(planes, solids, pool, whole, stack, begin, end):
    """Remove parts of faces that a solid hides from a set, and return its new end.

    The first `whole` pieces are whole faces, of which the hidden ones were left out before.
    """
    kept = begin
    for i in range(begin, end):
        if stack[i] < whole or not is_hidden(planes, solids, pool, stack[i]):
            stack[kept] = stack[i]
            kept += 1
    return kept


@fragment
def _emit_group(stack, begin, end, is_sorted, done, order, sets, totals):
    """Append a set to the order, and return the number of pieces in it."""
    for i in range(begin, end):
        order[done + i - begin] = stack[i]
    sets[GROUP_END, totals[GROUPS]] = done + end - begin
    sets[IS_SORTED, totals[GROUPS]] = 1 if is_sorted else 0
    totals[GROUPS] += 1
    return done + end - begin


@routine
def _choose_body(planes, pool, rank, stack, begin, end, present):
    """Return the convex solid of median depth in a set, or -1 without a convex solid."""
    for k in range(len(rank)):
        present[k] = -1
    count = 0
    for i in range(begin, end):
        b = planes.body[pool.pieces[SOURCE, stack[i]]]
        if rank[b] >= 0 and present[rank[b]] < 0:
            present[rank[b]] = b
            count += 1
    middle = count // 2
    for k in range(len(rank)):
        if present[k] >= 0:
            if middle == 0:
                return present[k]
            middle -= 1
    return -1


@routine
def _take_body(planes, pool, chosen, begin, end, lists):
    """List the pieces of a solid in a set, and return their number."""
    count = 0
    for i in range(begin, end):
        p = lists[STACK, i]
        if planes.body[pool.pieces[SOURCE, p]] == chosen:
            lists[OWN, count] = p
            count += 1
    return count


@routine
def _list_faces(pool, own, count, faces):
    """List the faces of pieces, each once, and return their number."""
    found = 0
    for i in range(count):
        source, known = pool.pieces[SOURCE, own[i]], False
        for k in range(found):
            known = known or faces[k] == source
        if not known:
            faces[found] = source
            found += 1
    return found


@routine
def _separate(planes, pool, chosen, begin, end, lists, faces, count, heights):
    """List the pieces in front of a face of a solid, and the others; return both numbers.

    The solid hides no piece in front of one of its faces, and no piece behind all faces hides the
    solid or a piece in front. A piece in the plane of a larger face counts as in front of it. Other
    pieces are cut, after all whole pieces. The numbers are -1 if there is no room.
    """
    near, far, cut = 0, 0, 0
    crossing = lists[ORDER]
    room = lists.shape[1]
    for i in range(begin, end):
        p = lists[STACK, i]
        if planes.body[pool.pieces[SOURCE, p]] != chosen:
            side = find_side(planes, pool, p, faces, count)
            if side > 0:
                lists[NEAR, near] = p
                near += 1
            elif side < 0:
                lists[FAR, far] = p
                far += 1
            else:
                # the end of the order is free as long as all pieces have room in it
                crossing[room - 1 - cut] = p
                cut += 1
    for i in range(cut):
        p = crossing[room - 1 - i]
        while True:
            best = find_highest_face(planes, pool, p, faces, count, heights)
            if best == -2:
                return -1, -1
            if best < 0:
                lists[FAR, far] = p
                far += 1
                break
            if is_above(pool, p, best, heights, planes.near):
                lists[NEAR, near] = p
                near += 1
                break
            if not cut_piece(pool, p, best, heights) or max(near, far) + 2 > room:
                return -1, -1
            lists[NEAR, near] = pool.totals[PIECES] - 2
            near += 1
            p = pool.totals[PIECES] - 1
    return near, far
