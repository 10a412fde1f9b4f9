"""Stages of barriers in the image: the distance of marks from the border, and their depth.

A barrier h >= 0 gives the row C qdot >= bound with C = dh/dq and bound = -rate h. C follows from
the interaction matrix of a point (Chaumette and Hutchinson 2006, eq. 4), the Jacobian of the lens
and the Jacobian of the camera.
"""

import numpy as np

from robsim.kernels.formulas.fisheye import distort_fisheye_jacobian
from robsim.kernels.formulas.interaction import point_rates
from robsim.kernels.formulas.perspective import BROWN, FISHEYE, distort_jacobian
from robsim.kernels.images.lens_distortion import BORDER, lane_coefficients, lens_coefficients
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, absolute, get, get_lane, put, replace_lane, where
from robsim.kernels.machine.stages import stage

RETURN = 2.0  # rate of a mark back to its margin, over the rate towards it


@part
def _lens_jacobian(w, camera, lens, x, y):
    """Return (dx'/dx, dx'/dy, dy'/dy) of the lens at a normalised point."""
    xx, xy, yy = 1.0 + 0.0 * x, 0.0 * x, 1.0 + 0.0 * x
    if lens == BROWN:
        xx, xy, yy = distort_jacobian(x, y, lens_coefficients(w, camera))
    elif lens == FISHEYE:
        for i in range(WIDTH):
            k = lane_coefficients(w, camera, i)
            each = distort_fisheye_jacobian(get_lane(x, i), get_lane(y, i), k)
            xx, xy = replace_lane(xx, i, each[0]), replace_lane(xy, i, each[1])
            yy = replace_lane(yy, i, each[2])
    return xx, xy, yy


@part
def _pixel_rates(w, camera, lens, x, y, inverse, longer):
    """Return both rows (6,) of the interaction matrix of a pixel, at a depth 1/inverse.

    The focal lengths are those of the camera times `longer`, for the same pixel of a pinhole.
    """
    xx, xy, yy = _lens_jacobian(w, camera, lens, x, y)
    fu, skew, fv = get(w, camera), get(w, camera + 1), get(w, camera + 4)
    a, b = longer * (fu * xx + skew * xy), longer * (fu * xy + skew * yy)
    c, d = longer * (fv * xy), longer * (fv * yy)
    first, second = point_rates(x / longer, y / longer, inverse)
    return (
        (
            a * first[0], b * second[1], a * first[2] + b * second[2], a * first[3] + b * second[3],
            a * first[4] + b * second[4], a * first[5] + b * second[5],
        ),
        (
            c * first[0], d * second[1], c * first[2] + d * second[2], c * first[3] + d * second[3],
            c * first[4] + d * second[4], c * first[5] + d * second[5],
        ),
    )  # fmt: skip


@part
def _times_jacobian(w, row, J, n, j):
    """Return entry j of a row (6,) times J[6, n]."""
    total = row[0] * get(w, J + j) + row[1] * get(w, J + n + j) + row[2] * get(w, J + 2 * n + j)
    total = total + row[3] * get(w, J + 3 * n + j) + row[4] * get(w, J + 4 * n + j)
    return total + row[5] * get(w, J + 5 * n + j)


@part
def _apply_drift(w, row, drift):
    """Return the rate of a row (6,) by the twist at `drift` that is not commanded."""
    if drift < 0:
        return 0.0 * row[2]
    total = row[0] * get(w, drift) + row[1] * get(w, drift + 1) + row[2] * get(w, drift + 2)
    total = total + row[3] * get(w, drift + 3) + row[4] * get(w, drift + 4)
    return total + row[5] * get(w, drift + 5)


@part
def limit_rate(rate, dt):
    """Return a rate, at most the one that reaches a constraint in one period."""
    return where(rate * dt < 1.0, rate, 1.0 / dt)


@part
def _put_side(w, sign, row, seen, J, n, past, p, age, C):
    """Write one row of a side of the image, C = sign row J; return the motion and the fall of h.

    The last commands, the newest of which are at `past` (p, n), each moved the mark for one period,
    as far as the image is older. The motion is in pixels per period. The fall is the decrease of
    the rate of h by the last command, from the last row, which is still at C, to the present one.
    """
    moved, fall, was_seen = 0.0 * age, 0.0 * age, 0.0 * age
    for j in range(n):
        c, before = where(seen, sign * _times_jacobian(w, row, J, n, j), 0.0), get(w, C + j)
        put(w, C + j, c)
        if p > 0:
            fall = fall + (before - c) * get(w, past + j)
            was_seen = was_seen + absolute(before)
        for i in range(p):
            share = age - 1.0 * i
            most = 1.0 if i + 1 < p else np.inf  # the oldest command stands for all before it
            share = where(share > most, most, where(share > 0.0, share, 0.0))
            moved = moved + share * (c * get(w, past + i * n + j))
    return moved, where((was_seen > 0.0) & (fall > 0.0), fall, 0.0 * fall)


@stage
def compute_border_rows(
    w,
    step,
    N="count",
    pixels="N, 2",
    points="N, 2",
    depth="N",
    hidden="N or none",
    camera="22",
    lens="whole",
    J="6, n",
    n="count",
    settings="5",
    dt="row",
    drift="6 or none",
    age="row or none",
    past="p, n",
    p="count",
    ends="whole",
    C="m, n",
    bound="m",
    m="count",
):
    """Compute the rows of the distances of N marks from the four sides of the image, in pixels.

    The settings are the margin, the rate, the noise, the share of the depth and the share of the
    focal length that may be wrong. The rows hold for all combinations of their extreme values, of
    which there are `ends`: 1 without errors, else 4. The order is left, right, top and bottom for
    each mark, with all ends of a side together. A mark beyond its margin returns at twice the rate.
    `drift` is the twist of the camera relative to the target by prescribed motions.

    Over a period h changes by C qd dt + (d2h/dt2) dt^2 / 2. The last two rows, times the last
    command, estimate (d2h/dt2) dt; half of it raises the bound where it is negative.
    """
    margin, b = get(w, settings) + get(w, settings + 2), camera + BORDER
    rate = limit_rate(get(w, settings + 1), get(w, dt))
    back = limit_rate(RETURN * get(w, settings + 1), get(w, dt))
    old = get(w, age) if age >= 0 else 0.0 * rate
    for i in range(N):
        u, v, Z = get(w, pixels + 2 * i), get(w, pixels + 2 * i + 1), get(w, depth + i)
        x, y = get(w, points + 2 * i), get(w, points + 2 * i + 1)
        seen = (absolute(x) < np.inf) & (absolute(y) < np.inf) & (Z > 0.0)
        if hidden >= 0:
            seen = seen & ~(get(w, hidden + i) > 0.0)
        for end in range(ends):
            nearer, longer = 1.0 + 0.0 * rate, 1.0 + 0.0 * rate
            if ends > 1:
                nearer = 1.0 + (2.0 * (end % 2) - 1.0) * get(w, settings + 3)
                longer = 1.0 + (2.0 * (end // 2 % 2) - 1.0) * get(w, settings + 4)
            rows = _pixel_rates(w, camera, lens, x, y, nearer / Z, longer)
            at = 4 * ends * i + end
            for side in range(4):
                sign = 1.0 if side % 2 == 0 else -1.0
                row, here = (rows[0], u) if side < 2 else (rows[1], v)
                distance = sign * (here - get(w, b + side)) - margin
                to = at + ends * side
                moved, fall = _put_side(w, sign, row, seen, J, n, past, p, old, C + to * n)
                flow = sign * _apply_drift(w, row, drift)
                distance = distance + get(w, dt) * (moved + old * flow)
                least = where(distance < 0.0, -back * distance, -rate * distance)
                put(w, bound + to, where(seen, least + 0.5 * fall - flow, -np.inf))


@stage
def compute_depth_rows(
    w,
    step,
    N="count",
    points="N, 2",
    depth="N",
    hidden="N or none",
    J="6, n",
    n="count",
    settings="3",
    dt="row",
    drift="6 or none",
    ends="whole",
    C="m, n",
    bound="m",
    m="count",
):
    """Compute the rows of the depths of N marks over a least depth.

    The settings are the least depth, the rate, and the share by which the true 1/Z may differ from
    that of the row. A row is affine in Z, so that rows for both ends hold for all depths between
    them: `ends` is 1 without errors, else 2.
    """
    rate = limit_rate(get(w, settings + 1), get(w, dt))
    for i in range(N):
        x, y = get(w, points + 2 * i), get(w, points + 2 * i + 1)
        seen = (absolute(x) < np.inf) & (absolute(y) < np.inf) & (get(w, depth + i) > -np.inf)
        if hidden >= 0:
            seen = seen & ~(get(w, hidden + i) > 0.0)
        for end in range(ends):
            nearer = 1.0 + 0.0 * rate
            if ends > 1:
                nearer = 1.0 + (2.0 * end - 1.0) * get(w, settings + 2)
            Z, zero, at = get(w, depth + i) / nearer, 0.0 * rate, ends * i + end
            row = zero, zero, zero - 1.0, -y * Z, x * Z, zero
            for j in range(n):
                put(w, C + n * at + j, where(seen, _times_jacobian(w, row, J, n, j), 0.0))
            least = -rate * (Z - get(w, settings)) - _apply_drift(w, row, drift)
            put(w, bound + at, where(seen, least, -np.inf))
