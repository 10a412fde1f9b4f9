"""Stages of images that come late or not at all: a ring of past ones, and what is used meanwhile.

An image is rows of N marks: their pixels, two of each, and below them their depths.
"""

import numpy as np

from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage


@stage
def store_image(
    w, step, n="count", then="n", between="n", share="row", ring="length, n", length="count"
):
    """Keep the image of the period that ends now: (count, then, between, share, ring, length).

    It was taken when the period began, in rows `then`, or, where a share of the period had passed,
    in rows `between`.
    """
    entry = ring + n * ((step - 1) % length)
    began = get(w, share) == 0.0
    for i in range(n):
        put(w, entry + i, where(began, get(w, then + i), get(w, between + i)))


@stage
def recall_image(
    w,
    step,
    every="whole",
    n="count",
    now="n",
    first="n",
    ring="length, n",
    length="count",
    delays="row",
    out="n",
):
    """Compute the image of a period so long ago, or that of the start where it is older.

    (every, count, now, first, ring, length, delay, out)
    """
    if step % every:
        return
    count = n
    if step == 0:
        for i in range(count):
            put(w, first + i, get(w, now + i))
    for b in range(WIDTH):
        delay = int(w[delays * WIDTH + b])
        source = now if delay == 0 else first
        if 0 < delay <= step:
            source = ring + count * ((step - delay) % length)
        for i in range(count):
            w[(out + i) * WIDTH + b] = w[(source + i) * WIDTH + b]


@stage
def receive_image(
    w,
    step,
    every="whole",
    N="count",
    pixels="N, 2",
    depth="N",
    hidden="N",
    lost="row",
    delay="row",
    taken="N, 2",
    taken_depth="N",
    hides="N",
    age="row",
):
    """Take an image; hidden marks stay where they were, and all do where the image is lost.

    Afterwards `hidden` and `lost` are zero, for the stages of the next step to set.
    """
    if step % every:
        put(w, age, get(w, age) + 1.0)
        put(w, lost, 0.0)
        for n in range(N):
            put(w, hidden + n, 0.0)
        return
    none = np.inf if step == 0 else 0.0  # the first image is never lost, nor hidden
    kept = get(w, lost) > none
    put(w, lost, 0.0)
    for n in range(N):
        hides_now = get(w, hidden + n)
        gone = kept | (hides_now > none)
        for i in range(2):
            at = 2 * n + i
            put(w, taken + at, where(gone, get(w, taken + at), get(w, pixels + at)))
        put(w, taken_depth + n, where(gone, get(w, taken_depth + n), get(w, depth + n)))
        put(w, hides + n, where(kept, get(w, hides + n), hides_now))
        put(w, hidden + n, 0.0)
    put(w, age, where(kept, get(w, age) + 1.0, get(w, delay)))
