"""Pieces of faces that a convex solid hides from the viewer."""

from typing import Any, NamedTuple

from robsim.kernels.machine.intrinsics import fragment, routine
from robsim.kernels.raster.piece_cuts import COUNT, FIRST, SOURCE

FAR = 1e300  # on a ray


class PainterSolids(NamedTuple):
    """The first face of each solid and the number of faces, the ball around it, and the viewer.

    The radius of the ball is negative for a solid that is not convex. `sides` are the heights of
    the viewer over the faces, negative for a face turned away. A piece is hidden only if it is
    farther inside than `margin`, since its edges have a width.
    """

    first: Any
    balls: Any
    sides: Any
    viewer: Any
    margin: Any


@routine
def is_hidden(planes, solids, pool, p):
    """Return whether one of the other convex solids hides all of a piece."""
    own = planes.body[pool.pieces[SOURCE, p]]
    for b in range(len(solids.balls)):
        if b != own and _is_hidden_by(planes, solids, pool, p, b):
            return True
    return False


@routine
def _is_hidden_by(planes, solids, pool, p, b):
    """Return whether a convex solid hides all corners of a piece, and therefore the piece."""
    first = pool.pieces[FIRST, p]
    for c in range(first, first + pool.pieces[COUNT, p]):
        if not _passes_ball(solids, pool.corners[c], b):
            return False
        if not _passes_solid(planes, solids, pool.corners[c], b):
            return False
    return True


@fragment
def _passes_ball(solids, corner, b):
    """Return whether the ray from a corner to the viewer passes the ball around a solid."""
    ball, viewer = solids.balls[b], solids.viewer
    if ball[3] < 0.0:
        return False
    x, y, z = ball[0] - corner[0], ball[1] - corner[1], ball[2] - corner[2]
    dx = viewer[0] - viewer[3] * corner[0]
    dy = viewer[1] - viewer[3] * corner[1]
    dz = viewer[2] - viewer[3] * corner[2]
    along, length = x * dx + y * dy + z * dz, dx * dx + dy * dy + dz * dz
    reach = ball[3] * ball[3] * length
    return (x * x + y * y + z * z) * length - along * along <= reach and (
        along >= 0.0 or along * along <= reach
    )


@fragment
def _passes_solid(planes, solids, corner, b):
    """Return whether the ray from a corner to the viewer passes through a convex solid.

    The ray is inside the solid from `enter` to `leave`; the viewer is at 1, or infinitely far away.
    A solid around the viewer hides nothing.
    """
    scale = solids.viewer[3]
    enter, leave = 0.0, FAR
    for f in range(solids.first[b], solids.first[b + 1]):
        nx, ny, nz = planes.normals[f, 0], planes.normals[f, 1], planes.normals[f, 2]
        depth = planes.offsets[f] - nx * corner[0] - ny * corner[1] - nz * corner[2]
        rate = -abs(solids.sides[f]) - scale * depth
        if solids.sides[f] < 0.0:  # the plane is turned to the viewer
            depth, rate = -depth, -rate
        if rate > 0.0:
            enter = max(enter, (solids.margin - depth) / rate)
        elif rate < 0.0:
            leave = min(leave, (solids.margin - depth) / rate)
        elif depth < solids.margin:
            return False
        if enter >= leave:
            return False
    return leave < FAR and (scale == 0.0 or leave < 1.0)
