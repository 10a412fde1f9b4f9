"""Stages of marks that are hidden for a while, and of the features that are lost with them."""

import numpy as np

from robsim.kernels.formulas.camera import IN_IMAGE
from robsim.kernels.machine.lanes import get, put, where
from robsim.kernels.machine.stage import stage

AT_ONCE = 1e-9  # seconds: rounding of the time of an image, step * dt - latency, is smaller


@stage
def hide(p, w, step):
    """Hide marks of an image that is taken within a time: (dt, latency, start, end, n, marks).

    The marks are n numbers of rows, of whether each is hidden.
    """
    seconds = step * get(w, p[0]) - get(w, p[1])
    seconds = where(seconds > 0.0, seconds, 0.0) + AT_ONCE
    now = (get(w, p[2]) <= seconds) & (seconds < get(w, p[3]))
    for i in range(p[4]):
        put(w, p[5 + i], where(now, 1.0, get(w, p[5 + i])))


@stage
def lack(p, w, step):
    """Copy an image without the marks that are not in it: (N, pixels, depth, status, and both out).

    The pixels of a mark with another status than that of one in the image are NaN.
    """
    for n in range(p[0]):
        here = get(w, p[3] + n) == 1.0 * IN_IMAGE
        for i in range(2):
            put(w, p[4] + 2 * n + i, where(here, get(w, p[1] + 2 * n + i), np.nan))
        put(w, p[5] + n, get(w, p[2] + n))


@stage
def lose_numbers(p, w, step):
    """Compute which numbers depend on hidden marks, unless all of them do: (k, lost).

    Then of each number: on how many marks it depends, and the rows of whether these are hidden.
    """
    at, whole = 2, 0.0 * get(w, p[1]) + 1.0
    for i in range(p[0]):
        gone = 0.0 * whole
        for j in range(p[at]):
            gone = where(get(w, p[at + 1 + j]) > 0.0, 1.0, gone)
        put(w, p[1] + i, gone)
        whole = where(gone > 0.0, whole, 0.0)
        at += 1 + p[at]
    for i in range(p[0]):
        put(w, p[1] + i, where(whole > 0.0, 0.0, get(w, p[1] + i)))
