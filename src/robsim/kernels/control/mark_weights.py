"""Stages that compute the weights of marks, and of the feature components that depend on the marks.

The weight is 0 for a mark that is absent or excluded, and 1 for a mark that counts in full. Between
0 and 1 it follows the polynomial 6 x^5 - 15 x^4 + 10 x^3, which is twice differentiable.
"""

import numpy as np

from robsim.kernels.formulas.perspective import IN_IMAGE, OUT_OF_IMAGE
from robsim.kernels.formulas.speed_profiles import quintic_profile
from robsim.kernels.images.lens_distortion import BORDER
from robsim.kernels.linear_algebra.pseudoinverse import solve_block
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, where
from robsim.kernels.machine.stages import stage


@part
def _smooth_weight(x):
    """Return the smooth weight, 0 for x <= 0 or NaN and 1 for x >= 1."""
    x = where(x > 0.0, x, 0.0)
    return quintic_profile(where(x < 1.0, x, 1.0))[0]


@stage
def flag_measured_marks(
    w, step, N="count", pixels="N, 2", points="N, 2", camera="22", out="N", hidden="N or none"
):
    """Compute 1 for marks that are measured in the image, else 0.

    A hidden mark is not measured. A mark without a finite normalised point is not measured either.
    """
    b = camera + BORDER
    for n in range(N):
        u, v = get(w, pixels + 2 * n), get(w, pixels + 2 * n + 1)
        x = get(w, points + 2 * n) + get(w, points + 2 * n + 1)
        inside = (u >= get(w, b)) & (u < get(w, b + 1)) & (v >= get(w, b + 2))
        inside = inside & (v < get(w, b + 3)) & (absolute(x) < np.inf)
        flag = where(inside, 1.0, 0.0)
        if hidden >= 0:
            flag = where(get(w, hidden + n) > 0.0, 0.0, flag)
        put(w, out + n, flag)


@stage
def weight_border_distance(w, step, N="count", pixels="N, 2", camera="22", width="row", out="N"):
    """Compute weights of marks by their distance from the border of the image.

    The weight is the product of one factor for each side. A factor is 1 at a distance of `width`
    pixels or more.
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
def fade_weights(w, step, N="count", present="N", seconds="row", dt="row", ramp="N", out="N"):
    """Compute weights of marks that fade in and out within `seconds`.

    At step 0 the present marks have weight 1. The rows `ramp` keep their values between steps.
    """
    change = get(w, dt) / get(w, seconds)
    for n in range(N):
        here = get(w, present + n)
        now = get(w, ramp + n) if step > 0 else here
        now = now + where(here > 0.0, change, -change)
        now = where(now > 0.0, now, 0.0)
        now = where(now < 1.0, now, 1.0)
        put(w, ramp + n, now)
        put(w, out + n, _smooth_weight(now))


@stage
def compute_smallest_weights(w, step, k="count", weights="k", numbers="each: each: row"):
    """Compute the weight of each feature component, the smallest weight of its marks.

    `numbers` holds the rows of the marks' weights for each feature component.
    """
    at = 1
    for i in range(k):
        smallest = get(w, numbers[at + 1])
        for j in range(1, numbers[at]):
            other = get(w, numbers[at + 1 + j])
            smallest = where(other < smallest, other, smallest)
        put(w, weights + i, smallest)
        at += 1 + numbers[at]


@stage
def require_enough_marks(w, step, k="count", out="k", least_count="whole", weights="each: row"):
    """Compute k weights, 1 if at least `least_count` marks have a positive weight, else 0."""
    count = 0.0 * get(w, weights[1])
    for n in range(weights[0]):
        count = count + where(get(w, weights[1 + n]) > 0.0, 1.0, 0.0)
    for i in range(k):
        put(w, out + i, where(count >= 1.0 * least_count, 1.0, 0.0))


@stage
def flag_unused_numbers(w, step, k="count", weights="k", out="k"):
    """Compute 1 for feature components of weight 0, else 0."""
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
    full_rank="row",
    rcond="row",
    marks="whole",
    status="row",
    zeros="k + 6",
    scratch="size",
    images="each: N=count; weights=N",
    translations="whole",
    size="count",
):
    """Compute the status OUT_OF_IMAGE if too few marks remain for a command, else IN_IMAGE.

    The status is OUT_OF_IMAGE if fewer than `marks` marks have a positive weight. If a feature
    component is unused, the status is also OUT_OF_IMAGE if the rank of A = L J is below both the
    number in the row `full_rank` and the rank of J. See `solve_block` for J, and `solve_task` for
    `translations`.
    """
    rcond, metres = get(w, rcond), J if J >= 0 else -1 - translations
    unused = 0.0 * rcond
    for i in range(k):
        unused = where(get(w, weights + i) > 0.0, unused, 1.0)
    count = 0.0 * rcond
    for i in range(images[0]):
        for m in range(images[1 + 2 * i]):
            count = count + where(get(w, images[2 + 2 * i] + m) > 0.0, 1.0, 0.0)
    too_few = count < 1.0 * marks
    if any_lane(unused > 0.0):
        rank = solve_block(w, A, k, n, zeros, -1, rcond, scratch, metres, scratch + n)
        least_rank = get(w, full_rank)
        if J >= 0:
            rank_of_J = solve_block(w, J, 6, n, zeros, -1, rcond, scratch, metres, scratch + n)
            least_rank = where(rank_of_J < least_rank, rank_of_J, least_rank)
        too_few = too_few | ((unused > 0.0) & (rank < least_rank))
    put(w, status, where(too_few, 1.0 * OUT_OF_IMAGE, 1.0 * IN_IMAGE))


@stage
def compute_row_maximum(w, step, out="row", rows="each: row"):
    """Compute the maximum of rows."""
    largest = get(w, rows[1])
    for i in range(1, rows[0]):
        other = get(w, rows[1 + i])
        largest = where(other > largest, other, largest)
    put(w, out, largest)
