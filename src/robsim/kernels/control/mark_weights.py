"""Stages of the weights of marks, and of the numbers that a feature makes of them.

A weight is 0 where a mark is not there or is not to count, 1 where it counts in full, and goes from
one to the other by the polynomial 6 x^5 - 15 x^4 + 10 x^3, which is twice differentiable.
"""

import numpy as np

from robsim.kernels.formulas.perspective import IN_IMAGE, OUT_OF_IMAGE
from robsim.kernels.formulas.speed_profiles import quintic_profile
from robsim.kernels.images.projection import BORDER
from robsim.kernels.linear_algebra.pseudoinverse import solve_block
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, where
from robsim.kernels.machine.stages import stage


@part
def _smooth_weight(x):
    """Return the share from 0 at x = 0 to 1 at x = 1, constant beyond, and 0 where x is NaN."""
    x = where(x > 0.0, x, 0.0)
    return quintic_profile(where(x < 1.0, x, 1.0))[0]


@stage
def flag_measured_marks(
    w, step, N="count", pixels="N, 2", points="N, 2", camera="22", out="N", hidden="N or none"
):
    """Compute 1 for marks that are measured in the image, else 0: (N, pixels, points, camera, out).

    Then the rows of whether they are hidden, or -1. A pixel without a direction is not measured.
    """
    b = camera + BORDER
    for n in range(N):
        u, v = get(w, pixels + 2 * n), get(w, pixels + 2 * n + 1)
        x = get(w, points + 2 * n) + get(w, points + 2 * n + 1)
        inside = (u >= get(w, b)) & (u < get(w, b + 1)) & (v >= get(w, b + 2))
        inside = inside & (v < get(w, b + 3)) & (absolute(x) < np.inf)
        found = where(inside, 1.0, 0.0)
        if hidden >= 0:
            found = where(get(w, hidden + n) > 0.0, 0.0, found)
        put(w, out + n, found)


@stage
def weight_border_distance(w, step, N="count", pixels="N, 2", camera="22", width="row", out="N"):
    """Compute the weights of marks by their way to the border: (N, pixels, camera, width, out).

    It is the product of a share for each of the four sides, each 1 from `width` pixels on.
    """
    b, width = camera + BORDER, get(w, width)
    for n in range(N):
        u, v = get(w, pixels + 2 * n), get(w, pixels + 2 * n + 1)
        across = _smooth_weight((u - get(w, b)) / width) * _smooth_weight(
            (get(w, b + 1) - u) / width
        )
        down = _smooth_weight((v - get(w, b + 2)) / width) * _smooth_weight(
            (get(w, b + 3) - v) / width
        )
        put(w, out + n, across * down)


@stage
def fade_weights(w, step, N="count", there="N", seconds="row", dt="row", ramp="N", out="N"):
    """Compute the weights of marks that come and go within a time: (N, there, time, dt, ramp, out).

    At the start those that are there count in full. The ramps are kept from step to step.
    """
    change = get(w, dt) / get(w, seconds)
    for n in range(N):
        here = get(w, there + n)
        now = get(w, ramp + n) if step > 0 else here
        now = now + where(here > 0.0, change, -change)
        now = where(now > 0.0, now, 0.0)
        now = where(now < 1.0, now, 1.0)
        put(w, ramp + n, now)
        put(w, out + n, _smooth_weight(now))


@stage
def compute_smallest_weights(w, step, k="count", weights="k", numbers="each: each: row"):
    """Compute the smallest weight of the marks that each number depends on: (k, weights).

    Then of each number: on how many marks it depends, and the rows of their weights.
    """
    at = 1
    for i in range(k):
        found = get(w, numbers[at + 1])
        for j in range(1, numbers[at]):
            other = get(w, numbers[at + 1 + j])
            found = where(other < found, other, found)
        put(w, weights + i, found)
        at += 1 + numbers[at]


@stage
def require_enough_marks(w, step, k="count", out="k", needed="whole", weights="each: row"):
    """Compute k weights: 1 where enough marks are there, else 0: (k, out, enough, marks).

    Then the rows of the weights of so many marks.
    """
    count = 0.0 * get(w, weights[1])
    for n in range(weights[0]):
        count = count + where(get(w, weights[1 + n]) > 0.0, 1.0, 0.0)
    for i in range(k):
        put(w, out + i, where(count >= 1.0 * needed, 1.0, 0.0))


@stage
def flag_unused_numbers(w, step, k="count", weights="k", out="k"):
    """Compute 1 for numbers of weight 0, else 0: (k, weights, out)."""
    for i in range(k):
        put(w, out + i, where(get(w, weights + i) > 0.0, 0.0, 1.0))


@stage
def detect_too_few_marks(
    w,
    step,
    k="count",
    n="count",
    A="k, n",
    J="6, n or none",
    weights="k",
    least="row",
    rcond="row",
    marks="whole",
    status="row",
    zeros="k + 6",
    room="size",
    images="each: N=count; weights=N",
    slides="whole",
    size="count",
):
    """Compute whether too little is left to command: (k, n, A, J, weights, needed, rcond, ...).

    Then how many marks are needed, the status, zeros, room, the number of images, and of each the
    number of its marks and the rows of their weights. The status is that of a mark out of the image
    where fewer marks are in use than needed; or where numbers are not, and the rank of A = L J is
    below the needed one and that of J, where `J` is the row of J (see `solve_block`).
    """
    rcond, metres = get(w, rcond), J if J >= 0 else -1 - slides
    unused = 0.0 * rcond
    for i in range(k):
        unused = where(get(w, weights + i) > 0.0, unused, 1.0)
    count = 0.0 * rcond
    for i in range(images[0]):
        for m in range(images[1 + 2 * i]):
            count = count + where(get(w, images[2 + 2 * i] + m) > 0.0, 1.0, 0.0)
    lost = count < 1.0 * marks
    if any_lane(unused > 0.0):
        rank = solve_block(w, A, k, n, zeros, -1, rcond, room, metres, room + n)
        needed = get(w, least)
        if J >= 0:
            of_J = solve_block(w, J, 6, n, zeros, -1, rcond, room, metres, room + n)
            needed = where(of_J < needed, of_J, needed)
        lost = lost | ((unused > 0.0) & (rank < needed))
    put(w, status, where(lost, 1.0 * OUT_OF_IMAGE, 1.0 * IN_IMAGE))


@stage
def compute_row_maximum(w, step, out="row", rows="each: row"):
    """Compute the largest of some rows: (how many, out), and the rows."""
    found = get(w, rows[1])
    for i in range(1, rows[0]):
        other = get(w, rows[1 + i])
        found = where(other > found, other, found)
    put(w, out, found)
