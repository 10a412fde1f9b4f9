"""Faces before a camera: their sides, their plane and their pixels."""

import math

from robsim.kernels.machine.jit import kernel, part

NEAR = 1e-4  # depth in metres up to which a camera sees nothing


@part
def place_faces(faces, T_c_b, plane, light, width, height, placed):
    """Compute the faces of bodies at poses T_c_b (bodies, 3, 4), in the light of a direction.

    `light` is (lx, ly, lz, ambient): the unit direction of the rays in camera axes, and the share
    of light from everywhere. A face that turns away or is out of the image has an empty box.
    """
    _move_corners(faces, T_c_b, placed.points)
    for f in range(faces.body.size):
        placed.box[f, 0], placed.box[f, 1] = 1, 0
        T = T_c_b[faces.body[f]]
        nx, ny, nz = _rotate(T, faces.normal[f, 0], faces.normal[f, 1], faces.normal[f, 2])
        at = placed.points[faces.first[f]]
        distance = nx * at[0] + ny * at[1] + nz * at[2]
        if distance >= 0.0 or not _find_box(faces, plane, width, height, f, placed):
            continue
        _compute_sides(faces, plane.inverse, f, placed)
        near = faces.nearer[f] / distance
        _multiply_row(plane.inverse, nx * near, ny * near, nz * near, placed.plane[f, 2])
        facing = max(0.0, -(nx * light[0] + ny * light[1] + nz * light[2]))
        lit = light[3] + (1.0 - light[3]) * facing
        placed.shade[f] = lit if faces.picture[f] >= 0 else lit * faces.grey[f]
        if faces.picture[f] >= 0:
            _compute_texels(faces.texel[f], T, plane.inverse, f, placed)


@kernel
def _rotate(T, x, y, z):
    """Return a vector in camera axes."""
    return (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z,
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z,
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z,
    )


@part
def _move_corners(faces, T_c_b, points):
    """Compute the corners of all faces in camera axes."""
    for i in range(points.shape[0]):
        T = T_c_b[faces.corner_body[i]]
        x, y, z = _rotate(T, faces.corners[i, 0], faces.corners[i, 1], faces.corners[i, 2])
        points[i, 0], points[i, 1], points[i, 2] = x + T[0, 3], y + T[1, 3], z + T[2, 3]


@kernel
def _multiply_row(M, x, y, z, out):
    """Compute the row vector (x, y, z) M of an upper triangular matrix M."""
    out[0] = x * M[0, 0]
    out[1] = x * M[0, 1] + y * M[1, 1]
    out[2] = x * M[0, 2] + y * M[1, 2] + z * M[2, 2]


@part
def _compute_sides(faces, inverse, f, placed):
    """Compute the planes through the eye and each side of a face; inside they are positive."""
    points, first, end = placed.points, faces.first[f], faces.first[f + 1]
    for i in range(first, end):
        p, q = points[i], points[i + 1 if i + 1 < end else first]
        x = q[1] * p[2] - q[2] * p[1]
        y = q[2] * p[0] - q[0] * p[2]
        z = q[0] * p[1] - q[1] * p[0]
        _multiply_row(inverse, x, y, z, placed.sides[i])


@part
def _compute_texels(texel, T, inverse, f, placed):
    """Compute the column and row of a picture, both divided by the depth.

    A texel coordinate is g . p + o at the point p = ray Z. Divided by Z it is g . ray + o / Z.
    """
    near = placed.plane[f, 2]
    for r in range(2):
        gx, gy, gz = _rotate(T, texel[r, 0], texel[r, 1], texel[r, 2])
        offset = texel[r, 3] - (gx * T[0, 3] + gy * T[1, 3] + gz * T[2, 3])
        row = placed.plane[f, r]
        _multiply_row(inverse, gx, gy, gz, row)
        for k in range(3):
            row[k] += offset * near[k]


@part
def _find_box(faces, plane, width, height, f, placed):
    """Compute the columns and rows that may see a face; return whether there are any.

    A face with corners behind the camera may be seen anywhere.
    """
    left, right, top, bottom = math.inf, -math.inf, math.inf, -math.inf
    before, M = 0, plane.matrix
    for i in range(faces.first[f], faces.first[f + 1]):
        p = placed.points[i]
        if p[2] > NEAR:
            before += 1
            x = (M[0, 0] * p[0] + M[0, 1] * p[1]) / p[2] + M[0, 2]
            y = M[1, 1] * p[1] / p[2] + M[1, 2]
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
    if before == 0:
        return False
    if before < faces.first[f + 1] - faces.first[f]:
        left, right, top, bottom = -math.inf, math.inf, -math.inf, math.inf
    box = placed.box[f]
    if plane.bends:
        box[0], box[1] = _find_range(plane.column_ends, left, right)
        box[2], box[3] = _find_range(plane.row_ends, top, bottom)
    else:
        box[0], box[1] = math.ceil(max(left, 0.0)), math.floor(min(right, width - 1.0))
        box[2], box[3] = math.ceil(max(top, 0.0)), math.floor(min(bottom, height - 1.0))
    seen = box[0] <= box[1] and box[2] <= box[3]
    if not seen:
        box[0], box[1] = 1, 0
    return seen


@kernel
def _find_range(ends, low, high):
    """Return the first and the last line of pixels whose rays may lie between two limits.

    `ends` (2, n) are the least rays from each line to the end, and the greatest ones up to it.
    """
    n = ends.shape[1]
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
