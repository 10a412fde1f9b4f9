"""Stages of images that come late or not at all: a ring of past ones, and what is used meanwhile.

An image is rows of N marks: their pixels, two of each, and below them their depths.
"""

import numpy as np

from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stage import stage


@stage
def note(p, w, step):
    """Keep the image of the period that ends now: (count, then, between, share, ring, length).

    It was taken when the period began, in rows `then`, or, where a share of the period had passed,
    in rows `between`.
    """
    entry = p[4] + p[0] * ((step - 1) % p[5])
    began = get(w, p[3]) == 0.0
    for i in range(p[0]):
        put(w, entry + i, where(began, get(w, p[1] + i), get(w, p[2] + i)))


@stage
def recall(p, w, step):
    """Compute the image of a period so long ago, or that of the start where it is older.

    (every, count, now, first, ring, length, delay, out)
    """
    if step % p[0]:
        return
    count, now, first, ring, length = p[1], p[2], p[3], p[4], p[5]
    if step == 0:
        for i in range(count):
            put(w, first + i, get(w, now + i))
    for b in range(WIDTH):
        delay = int(w[p[6] * WIDTH + b])
        source = now if delay == 0 else first
        if 0 < delay <= step:
            source = ring + count * ((step - delay) % length)
        for i in range(count):
            w[(p[7] + i) * WIDTH + b] = w[(source + i) * WIDTH + b]


@stage
def receive(p, w, step):
    """Take what arrives; hidden marks stay where they were, and all do where the image is lost.

    (every, N, pixels, depth, hidden, lost, delay; and what is taken: pixels, depth, hidden, age)
    """
    taken, hides, age = p[7], p[9], p[10]
    if step % p[0]:
        put(w, age, get(w, age) + 1.0)
        return
    none = np.inf if step == 0 else 0.0  # the first image is never lost, nor hidden
    kept = get(w, p[5]) > none
    for n in range(p[1]):
        gone = kept | (get(w, p[4] + n) > none)
        for i in range(2):
            at = 2 * n + i
            put(w, taken + at, where(gone, get(w, taken + at), get(w, p[2] + at)))
        put(w, p[8] + n, where(gone, get(w, p[8] + n), get(w, p[3] + n)))
        put(w, hides + n, where(kept, get(w, hides + n), get(w, p[4] + n)))
    put(w, age, where(kept, get(w, age) + 1.0, get(w, p[6])))
