"""Distortion of image points by the lens of a camera, as stages that other stages call.

Few cameras have a lens with distortion, so these stages are compiled when they are first needed.
"""

import math

from robsim.kernels.formulas.fisheye import distort_fisheye, undistort_fisheye
from robsim.kernels.formulas.perspective import BROWN, distort, undistort
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, get, get_lane, put, replace_lane, where
from robsim.kernels.machine.linked_stages import link_stage
from robsim.kernels.machine.stages import stage

LENS, BORDER, RADIUS = 9, 17, 21  # first rows of the parts of a camera after K


@part
def lens_coefficients(w, camera):
    """Return the eight lens coefficients of a camera."""
    at = camera + LENS
    return (
        get(w, at), get(w, at + 1), get(w, at + 2), get(w, at + 3),
        get(w, at + 4), get(w, at + 5), get(w, at + 6), get(w, at + 7),
    )  # fmt: skip


@part
def lane_coefficients(w, camera, i):
    """Return the eight lens coefficients of the camera of one lane."""
    k = (camera + LENS) * WIDTH + i
    return (
        w[k], w[k + WIDTH], w[k + 2 * WIDTH], w[k + 3 * WIDTH],
        w[k + 4 * WIDTH], w[k + 5 * WIDTH], w[k + 6 * WIDTH], w[k + 7 * WIDTH],
    )  # fmt: skip


@part
def _distort_fisheye_lanes(w, camera, x, y):
    """Return the images of normalised points by fisheye lenses, lane by lane."""
    for i in range(WIDTH):
        bent = distort_fisheye(get_lane(x, i), get_lane(y, i), lane_coefficients(w, camera, i))
        x, y = replace_lane(x, i, bent[0]), replace_lane(y, i, bent[1])
    return x, y


@stage
def distort_point(numbers, w, step):
    """Replace a normalised point by its image, with numbers = (camera, lens, point).

    `lens` is BROWN or FISHEYE.
    """
    camera, lens, point = numbers[0], numbers[1], numbers[2]
    x, y = get(w, point), get(w, point + 1)
    if lens == BROWN:
        x, y = distort(x, y, lens_coefficients(w, camera))
    else:
        x, y = _distort_fisheye_lanes(w, camera, x, y)
    put(w, point, x)
    put(w, point + 1, y)


@part
def _undistort_fisheye_lanes(w, camera, x, y):
    """Return the points that fisheye lenses map to (x, y), lane by lane."""
    for i in range(WIDTH):
        radius = w[(camera + RADIUS) * WIDTH + i]
        k = lane_coefficients(w, camera, i)
        straight = undistort_fisheye(get_lane(x, i), get_lane(y, i), k, radius)
        x, y = replace_lane(x, i, straight[0]), replace_lane(y, i, straight[1])
    return x, y


@stage
def undistort_points(numbers, w, step):
    """Replace the images of N points by the points, with numbers = (camera, lens, N, points).

    `lens` is BROWN or FISHEYE. An image without a point within the valid radius of the lens gives
    NaN.
    """
    camera, lens, N, points = numbers[0], numbers[1], numbers[2], numbers[3]
    radius = get(w, camera + RADIUS)
    for n in range(N):
        x, y = get(w, points + 2 * n), get(w, points + 2 * n + 1)
        if lens == BROWN:
            x, y = undistort(x, y, lens_coefficients(w, camera))
        else:
            x, y = _undistort_fisheye_lanes(w, camera, x, y)
        valid = x * x + y * y <= radius * radius
        put(w, points + 2 * n, where(valid, x, math.nan))
        put(w, points + 2 * n + 1, where(valid, y, math.nan))


linked_distortion, linked_undistortion = link_stage(distort_point), link_stage(undistort_points)
