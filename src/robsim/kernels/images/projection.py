"""Stages that project marks into a camera's image, and normalise pixels.

The rows of a camera are K (nine), the lens coefficients (eight), the border of the image (four) and
the largest valid radius of the lens. A mark has two rows in an image, column and row.
"""

import numpy as np

from robsim.kernels.formulas.perspective import (
    BEHIND_CAMERA,
    IN_IMAGE,
    LEAST_DEPTH,
    NO_LENS,
    OUT_OF_IMAGE,
    pinhole_pixel,
)
from robsim.kernels.images.lens_distortion import (
    BORDER,
    RADIUS,
    linked_distortion,
    linked_undistortion,
)
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import get, put, where
from robsim.kernels.machine.stages import stage

CAMERA_ROWS = 22  # number of rows of a camera
WORST_STATUS, CONTINUED_STATUS, EACH_STATUS = (
    0,
    1,
    2,
)  # status: the worst, the worst including earlier marks, of each mark


@part
def _camera_to_mark(w, T_w_o, T_w_c, mark, r):
    """Return component r of the vector from the camera to a mark, in world axes."""
    o = T_w_o + 4 * r
    there = get(w, o) * get(w, mark) + get(w, o + 1) * get(w, mark + 1)
    there = there + get(w, o + 2) * get(w, mark + 2)
    return there + (get(w, o + 3) - get(w, T_w_c + 4 * r + 3))


@part
def _axis_component(w, T, c, x, y, z):
    """Return the component of a vector along an axis of T."""
    return get(w, T + c) * x + get(w, T + 4 + c) * y + get(w, T + 8 + c) * z


@kernel
def _mark_status(w, camera, X, Y, Z, u, v):
    """Return the status of a mark: IN_IMAGE, OUT_OF_IMAGE or BEHIND_CAMERA."""
    b = camera + BORDER
    inside = (u >= get(w, b)) & (u < get(w, b + 1)) & (v >= get(w, b + 2)) & (v < get(w, b + 3))
    radius = get(w, camera + RADIUS) * Z
    inside = inside & (radius * radius >= X * X + Y * Y)
    return where(Z > LEAST_DEPTH, where(inside, 1.0 * IN_IMAGE, OUT_OF_IMAGE), BEHIND_CAMERA)


@stage
def project_to_pixels(
    w,
    step,
    marks="N, 3",
    N="count",
    T_w_c="3, 4",
    T_w_o="3, 4",
    camera="22",
    lens="whole",
    pixels="N, 2",
    depth="N",
    status="S",
    mode="whole",
    S="count",
):
    """Compute the pixels, depths and status of N marks. Pixels behind the camera are NaN.

    `lens` is NO_LENS, BROWN or FISHEYE. `mode` selects the status: WORST_STATUS is the worst
    status of the marks, CONTINUED_STATUS is the worst status of these marks and of earlier calls,
    and EACH_STATUS is one status for each mark.
    """
    C, O = T_w_c, T_w_o
    worst = get(w, status) if mode == CONTINUED_STATUS else 0.0 * get(w, camera)
    for n in range(N):
        m = marks + 3 * n
        x, y = _camera_to_mark(w, O, C, m, 0), _camera_to_mark(w, O, C, m, 1)
        z = _camera_to_mark(w, O, C, m, 2)
        X, Y, Z = (
            _axis_component(w, C, 0, x, y, z),
            _axis_component(w, C, 1, x, y, z),
            _axis_component(w, C, 2, x, y, z),
        )
        behind, inverse = where(Z > LEAST_DEPTH, 0.0 * Z, np.nan), 1.0 / Z
        x, y = X * inverse + behind, Y * inverse + behind
        if lens != NO_LENS:
            put(w, pixels + 2 * n, x)
            put(w, pixels + 2 * n + 1, y)
            linked_distortion(w, (camera, lens, pixels + 2 * n))
            x, y = get(w, pixels + 2 * n), get(w, pixels + 2 * n + 1)
        u, v = _pixel_from_camera(w, camera, x, y)
        put(w, pixels + 2 * n, u)
        put(w, pixels + 2 * n + 1, v)
        put(w, depth + n, Z)
        now = _mark_status(w, camera, X, Y, Z, u, v)
        if mode == EACH_STATUS:
            put(w, status + n, now)
            continue
        worst = where(now > worst, now, worst)
    if mode != EACH_STATUS:
        put(w, status, worst)


@part
def _pixel_from_camera(w, K, x, y):
    """Return the pixel of a normalised image point."""
    return pinhole_pixel(
        x, y, get(w, K), get(w, K + 1), get(w, K + 2), get(w, K + 4), get(w, K + 5)
    )


@stage
def normalise_mark_pixels(
    w, step, camera="22", N="count", pixels="N, 2", points="N, 2", lens="whole"
):
    """Compute normalised image points of pixels.

    `lens` is NO_LENS, BROWN or FISHEYE. A distorted pixel without a point within the valid radius
    of the lens gives NaN.
    """
    K = camera
    for n in range(N):
        y = (get(w, pixels + 2 * n + 1) - get(w, K + 5)) / get(w, K + 4)
        x = (get(w, pixels + 2 * n) - get(w, K + 2) - get(w, K + 1) * y) / get(w, K)
        put(w, points + 2 * n, x)
        put(w, points + 2 * n + 1, y)
    if lens != NO_LENS:
        linked_undistortion(w, (K, lens, N, points))


@part
def put_relative_pose(w, A, B, T):
    """Compute T = A^-1 B, the pose of frame b in frame a, from their world poses."""
    for c in range(4):
        x, y, z = get(w, B + c), get(w, B + 4 + c), get(w, B + 8 + c)
        if c == 3:
            x, y, z = x - get(w, A + 3), y - get(w, A + 7), z - get(w, A + 11)
        for r in range(3):
            put(w, T + 4 * r + c, _axis_component(w, A, r, x, y, z))


@stage
def relative_pose_stage(w, step, A="3, 4", B="3, 4", T="3, 4"):
    """Compute T = A^-1 B."""
    put_relative_pose(w, A, B, T)
