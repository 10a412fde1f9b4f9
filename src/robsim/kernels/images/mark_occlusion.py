"""Stages of marks that are hidden for a while, and of the features that are lost with them."""

import numpy as np

from robsim.kernels.formulas.perspective import IN_IMAGE
from robsim.kernels.machine.lanes import get, put, where
from robsim.kernels.machine.stages import stage

TIME_ROUNDING = 1e-9  # seconds: rounding of the time of an image, step * dt - latency, is smaller


@stage
def hide_marks(w, step, dt="row", latency="row", start="row", end="row", marks="each: row"):
    """Hide marks of an image that is taken within a time: `marks` are 1 for those hidden."""
    seconds = step * get(w, dt) - get(w, latency)
    seconds = where(seconds > 0.0, seconds, 0.0) + TIME_ROUNDING
    now = (get(w, start) <= seconds) & (seconds < get(w, end))
    for i in range(marks[0]):
        put(w, marks[1 + i], where(now, 1.0, get(w, marks[1 + i])))


@stage
def blank_missing_marks(
    w, step, N="count", pixels="N, 2", depth="N", status="N", seen="N, 2", seen_depth="N"
):
    """Copy an image without the marks that are not in it: (N, pixels, depth, status, and both out).

    The pixels of a mark with another status than that of one in the image are NaN.
    """
    for n in range(N):
        here = get(w, status + n) == 1.0 * IN_IMAGE
        for i in range(2):
            put(w, seen + 2 * n + i, where(here, get(w, pixels + 2 * n + i), np.nan))
        put(w, seen_depth + n, get(w, depth + n))


@stage
def flag_lost_numbers(w, step, k="count", lost="k", numbers="each: each: row"):
    """Compute which numbers depend on hidden marks, unless all of them do: (k, lost).

    Then of each number: on how many marks it depends, and the rows of whether these are hidden.
    """
    at, whole = 1, 0.0 * get(w, lost) + 1.0
    for i in range(k):
        gone = 0.0 * whole
        for j in range(numbers[at]):
            gone = where(get(w, numbers[at + 1 + j]) > 0.0, 1.0, gone)
        put(w, lost + i, gone)
        whole = where(gone > 0.0, whole, 0.0)
        at += 1 + numbers[at]
    for i in range(k):
        put(w, lost + i, where(whole > 0.0, 0.0, get(w, lost + i)))
