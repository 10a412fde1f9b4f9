"""Stages that hide marks temporarily, and flag the feature components that depend on them."""

import numpy as np

from robsim.kernels.formulas.perspective import IN_IMAGE
from robsim.kernels.machine.lanes import get, put, where
from robsim.kernels.machine.stages import stage

TIME_ROUNDING = 1e-9  # seconds: larger than the rounding of an image's time, step * dt - latency


@stage
def hide_marks(w, step, dt="row", latency="row", start="row", end="row", marks="each: row"):
    """Set the rows of hidden marks to 1 if the image is taken between `start` and `end`."""
    seconds = step * get(w, dt) - get(w, latency)
    seconds = where(seconds > 0.0, seconds, 0.0) + TIME_ROUNDING
    now = (get(w, start) <= seconds) & (seconds < get(w, end))
    for i in range(marks[0]):
        put(w, marks[1 + i], where(now, 1.0, get(w, marks[1 + i])))


@stage
def blank_missing_marks(
    w, step, N="count", pixels="N, 2", depth="N", status="N", visible_pixels="N, 2", depth_out="N"
):
    """Copy the pixels and depths of marks, with NaN pixels for marks outside the image.

    A mark is in the image if its status is IN_IMAGE. The depths are copied for all marks.
    """
    for n in range(N):
        here = get(w, status + n) == 1.0 * IN_IMAGE
        for i in range(2):
            put(w, visible_pixels + 2 * n + i, where(here, get(w, pixels + 2 * n + i), np.nan))
        put(w, depth_out + n, get(w, depth + n))


@stage
def flag_lost_numbers(w, step, k="count", lost="k", numbers="each: each: row"):
    """Compute 1 for the feature components that depend on hidden marks, else 0.

    If all feature components depend on hidden marks, the result is 0 for all. `numbers` holds, for
    each feature component, the rows that are 1 for hidden marks.
    """
    at, all_hidden = 1, 0.0 * get(w, lost) + 1.0
    for i in range(k):
        is_hidden = 0.0 * all_hidden
        for j in range(numbers[at]):
            is_hidden = where(get(w, numbers[at + 1 + j]) > 0.0, 1.0, is_hidden)
        put(w, lost + i, is_hidden)
        all_hidden = where(is_hidden > 0.0, all_hidden, 0.0)
        at += 1 + numbers[at]
    for i in range(k):
        put(w, lost + i, where(all_hidden > 0.0, 0.0, get(w, lost + i)))
