"""Stages of a camera: the marks of an object in its image, and what a pixel says of a direction.

A camera has the rows of K, nine, of its lens, eight, of its border, four, and of the radius within
which its lens is valid; marks have two rows in an image, column and row.
"""

import math

import numpy as np

from robsim.kernels.formulas.perspective import (
    BEHIND_CAMERA,
    IN_IMAGE,
    LEAST_DEPTH,
    OUT_OF_IMAGE,
    distort,
    pinhole_pixel,
    undistort,
)
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage

LENS, BORDER, RADIUS = 9, 17, 21  # rows of a camera after those of K
CAMERA_ROWS = 22  # rows in all
WORST_STATUS, CONTINUED_STATUS, EACH_STATUS = 0, 1, 2  # what status is wanted


@part
def _lens_coefficients(w, eye):
    at = eye + LENS
    return (
        get(w, at), get(w, at + 1), get(w, at + 2), get(w, at + 3),
        get(w, at + 4), get(w, at + 5), get(w, at + 6), get(w, at + 7),
    )  # fmt: skip


@part
def _camera_to_mark(w, T_w_o, T_w_c, mark, r):
    """Return a component, in world axes, of the way from the camera to a mark."""
    o = T_w_o + 4 * r
    there = get(w, o) * get(w, mark) + get(w, o + 1) * get(w, mark + 1)
    there = there + get(w, o + 2) * get(w, mark + 2)
    return there + (get(w, o + 3) - get(w, T_w_c + 4 * r + 3))


@part
def _axis_component(w, T, c, x, y, z):
    """Return the component of a vector along an axis of T."""
    return get(w, T + c) * x + get(w, T + 4 + c) * y + get(w, T + 8 + c) * z


@kernel
def _mark_status(w, eye, X, Y, Z, u, v):
    """Return whether a mark is in the image, outside it, or behind the camera."""
    b = eye + BORDER
    inside = (u >= get(w, b)) & (u < get(w, b + 1)) & (v >= get(w, b + 2)) & (v < get(w, b + 3))
    radius = get(w, eye + RADIUS) * Z
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
    bends="whole",
    pixels="N, 2",
    depth="N",
    status="S",
    which="whole",
    S="count",
):
    """Compute pixels, NaN behind the camera, depths, and the worst status of all marks, or of each.

    (marks, their number, T_w_c, T_w_o, camera, whether its lens bends, pixels, depth, status,
    FIRST, MORE where others were seen before, or EACH)
    """
    C, O, eye = T_w_c, T_w_o, camera
    worst = get(w, status) if which == CONTINUED_STATUS else 0.0 * get(w, eye)
    for n in range(N):
        m = marks + 3 * n
        x, y, z = (
            _camera_to_mark(w, O, C, m, 0), _camera_to_mark(w, O, C, m, 1), _camera_to_mark(w, O, C, m, 2),
        )  # fmt: skip
        X, Y, Z = (
            _axis_component(w, C, 0, x, y, z),
            _axis_component(w, C, 1, x, y, z),
            _axis_component(w, C, 2, x, y, z),
        )
        behind, inverse = where(Z > LEAST_DEPTH, 0.0 * Z, np.nan), 1.0 / Z
        x, y = X * inverse + behind, Y * inverse + behind
        if bends:
            x, y = distort(x, y, _lens_coefficients(w, eye))
        u, v = _pixel_from_camera(w, eye, x, y)
        put(w, pixels + 2 * n, u)
        put(w, pixels + 2 * n + 1, v)
        put(w, depth + n, Z)
        now = _mark_status(w, eye, X, Y, Z, u, v)
        if which == EACH_STATUS:
            put(w, status + n, now)
            continue
        worst = where(now > worst, now, worst)
    if which != EACH_STATUS:
        put(w, status, worst)


@part
def _pixel_from_camera(w, K, x, y):
    return pinhole_pixel(
        x, y, get(w, K), get(w, K + 1), get(w, K + 2), get(w, K + 4), get(w, K + 5)
    )


@stage
def normalise_mark_pixels(
    w, step, camera="22", N="count", pixels="N, 2", points="N, 2", bends="whole"
):
    """Compute normalised image points of pixels: (camera, number, pixels, points, bends).

    NaN where a distorted pixel has no point within the valid radius.
    """
    K = camera
    for n in range(N):
        y = (get(w, pixels + 2 * n + 1) - get(w, K + 5)) / get(w, K + 4)
        x = (get(w, pixels + 2 * n) - get(w, K + 2) - get(w, K + 1) * y) / get(w, K)
        put(w, points + 2 * n, x)
        put(w, points + 2 * n + 1, y)
    if bends:
        for n in range(N):
            for i in range(WIDTH):
                _undistort_lane(w, K, points + 2 * n, i)


@part
def _undistort_lane(w, eye, point, i):
    """Replace a distorted point of one run by that without distortion, or NaN."""
    at, lens, radius = point * WIDTH + i, (eye + LENS) * WIDTH + i, w[(eye + RADIUS) * WIDTH + i]
    k = (
        w[lens], w[lens + WIDTH], w[lens + 2 * WIDTH], w[lens + 3 * WIDTH],
        w[lens + 4 * WIDTH], w[lens + 5 * WIDTH], w[lens + 6 * WIDTH], w[lens + 7 * WIDTH],
    )  # fmt: skip
    x, y = undistort(w[at], w[at + WIDTH], k)
    if not x * x + y * y <= radius * radius:
        x, y = math.nan, math.nan
    w[at], w[at + WIDTH] = x, y


@part
def put_relative_pose(w, A, B, T):
    """Compute T = A^-1 B: the pose of frame b in frame a, from both in the world."""
    for c in range(4):
        x, y, z = get(w, B + c), get(w, B + 4 + c), get(w, B + 8 + c)
        if c == 3:
            x, y, z = x - get(w, A + 3), y - get(w, A + 7), z - get(w, A + 11)
        for r in range(3):
            put(w, T + 4 * r + c, _axis_component(w, A, r, x, y, z))


@stage
def relative_pose_stage(w, step, A="3, 4", B="3, 4", T="3, 4"):
    """Compute T = A^-1 B for poses (A, B, T)."""
    put_relative_pose(w, A, B, T)
