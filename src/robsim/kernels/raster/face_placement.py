"""Faces before a camera: their sides, their plane and their pixels."""

import math

from robsim.kernels.machine.intrinsics import fragment, routine

NEAR = 1e-4  # depth in metres up to which a camera sees nothing
LEAST_SLOPE = 1e-150  # of a side; below, it is parallel to the rows


@routine
def place_faces(faces, T_c_b, plane, light, width, height, placed):
    """Compute the faces of bodies at poses T_c_b (bodies, 3, 4), in the light of a direction.

    `light` is (lx, ly, lz, ambient): the unit direction of the rays in camera axes, and the share
    of light from everywhere. A face that turns away or is out of the image has an empty box.
    """
    for f in range(faces.body.size):
        placed.box[f, 0], placed.box[f, 1] = 1, 0
        T, first, end = T_c_b[faces.body[f]], faces.first[f], faces.first[f + 1]
        nx, ny, nz = _rotate(T, faces.normal[f])
        x, y, z = _rotate(T, faces.corners[first])
        distance = nx * (x + T[0, 3]) + ny * (y + T[1, 3]) + nz * (z + T[2, 3])
        if distance >= 0.0:
            continue
        for i in range(first, end):
            x, y, z = _rotate(T, faces.corners[i])
            placed.points[i, 0] = x + T[0, 3]
            placed.points[i, 1] = y + T[1, 3]
            placed.points[i, 2] = z + T[2, 3]
        if not _find_box(plane, width, height, first, end, f, placed):
            continue
        _compute_sides(plane.inverse, first, end, placed)
        near = faces.nearer[f] / distance
        _multiply_row(plane.inverse, nx * near, ny * near, nz * near, placed.plane[f, 2])
        lit = light[3] + (1.0 - light[3]) * max(
            0.0, -(nx * light[0] + ny * light[1] + nz * light[2])
        )
        if faces.picture[f] >= 0:
            placed.shade[f] = lit
            _compute_texels(faces.texel[f], T, plane.inverse, f, placed)
        else:
            placed.shade[f] = lit * faces.grey[f]


@routine
def _rotate(T, p):
    """Return a vector in camera axes."""
    return (
        T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2],
        T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2],
        T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2],
    )


@routine
def _multiply_row(M, x, y, z, out):
    """Compute the row vector (x, y, z) M of an upper triangular matrix M."""
    out[0] = x * M[0, 0]
    out[1] = x * M[0, 1] + y * M[1, 1]
    out[2] = x * M[0, 2] + y * M[1, 2] + z * M[2, 2]


@fragment
def _compute_sides(inverse, first, end, placed):
    """Compute the planes through the eye and each side of a face; inside they are positive.

    They are scaled so that the factor of the column is -1, 0 or 1: then a row of pixels begins or
    ends at the value of the side at the column 0. Two faces with a common side have opposite
    numbers, so that no pixel between them is lost.
    """
    points, q = placed.points, placed.points[end - 1]
    for i in range(first, end):
        p, q, side = q, points[i], placed.sides[i]
        x = q[1] * p[2] - q[2] * p[1]
        y = q[2] * p[0] - q[0] * p[2]
        z = q[0] * p[1] - q[1] * p[0]
        _multiply_row(inverse, x, y, z, side)
        slope = abs(side[0])
        if slope > LEAST_SLOPE:
            side[0], side[1], side[2] = (
                math.copysign(1.0, side[0]),
                side[1] / slope,
                side[2] / slope,
            )
        else:
            side[0] = 0.0


@fragment
def _compute_texels(texel, T, inverse, f, placed):
    """Compute the column and row of a picture, both divided by the depth.

    A texel coordinate is g . p + o at the point p = ray Z. Divided by Z it is g . ray + o / Z.
    """
    near = placed.plane[f, 2]
    for r in range(2):
        gx, gy, gz = _rotate(T, texel[r])
        offset = texel[r, 3] - (gx * T[0, 3] + gy * T[1, 3] + gz * T[2, 3])
        row = placed.plane[f, r]
        _multiply_row(inverse, gx, gy, gz, row)
        for k in range(3):
            row[k] += offset * near[k]


@fragment
def _find_box(plane, width, height, first, end, f, placed):
    """Compute the columns and rows that may see a face; return whether there are any.

    A face with corners behind the camera may be seen anywhere.
    """
    left, right, top, bottom = math.inf, -math.inf, math.inf, -math.inf
    before, M = 0, plane.matrix
    for i in range(first, end):
        p = placed.points[i]
        if p[2] > NEAR:
            before += 1
            x = (M[0, 0] * p[0] + M[0, 1] * p[1]) / p[2] + M[0, 2]
            y = M[1, 1] * p[1] / p[2] + M[1, 2]
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
    if before == 0:
        return False
    if before < end - first:
        left, right, top, bottom = -math.inf, math.inf, -math.inf, math.inf
    box = placed.box[f]
    box[0], box[1] = _find_range(plane.column_ends, left, right, width)
    box[2], box[3] = _find_range(plane.row_ends, top, bottom, height)
    seen = box[0] <= box[1] and box[2] <= box[3]
    if not seen:
        box[0], box[1] = 1, 0
    return seen


@routine
def _find_range(ends, low, high, n):
    """Return the first and the last of n lines of pixels that may lie between two limits.

    With a distortion, `ends` (2, n) are the least rays from each line to the end, and the greatest
    ones up to it; without, it is None.
    """
    if ends is None:
        return math.ceil(max(low, 0.0)), math.floor(min(high, n - 1.0))
    first, step = 0, n
    while step > 0:  # the first line up to which a ray reaches `low`
        half = step // 2
        if ends[1, first + half] < low:
            first, step = first + half + 1, step - half - 1
        else:
            step = half
    last, step = 0, n
    while step > 0:  # the first line from which on all rays are beyond `high`
        half = step // 2
        if ends[0, last + half] <= high:
            last, step = last + half + 1, step - half - 1
        else:
            step = half
    return first, last - 1
