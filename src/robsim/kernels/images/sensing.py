"""Stages of the errors of an image: noise, mismatched marks, pixels, and lost images.

Their first number is the count of periods from one image to the next: between them nothing is done.
Standard deviations, shares and steps stand in rows, of each run its own.
"""

import numpy as np

from robsim.kernels.formulas import random
from robsim.kernels.formulas.steps import in_steps
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.memory import matrix, unsigned
from robsim.kernels.machine.stage import stage


@stage
def blur(p, w, step):
    """Compute pixels with Gaussian noise: (every, marks, pixels, sigma, seed, run, stream, out)."""
    if step % p[0]:
        return
    normal, sigma = matrix(w, p[7], p[1], 2), get(w, p[3])
    random.normal_pairs(np.uint64(p[4]), unsigned(w, p[5]), step, p[6], normal)
    for i in range(2 * p[1]):
        put(w, p[7] + i, get(w, p[2] + i) + sigma * get(w, p[7] + i))


@stage
def displace(p, w, step):
    """Add size times a standard normal to both coordinates of a share of the marks, in place.

    (every, marks, pixels, share, size, seed, run, stream)
    """
    if step % p[0]:
        return
    seed, runs = np.uint64(p[5]), unsigned(w, p[6])
    for n in range(p[1]):
        for b in range(WIDTH):
            if random.uniform(seed, runs[b], step, p[7], n) < w[p[3] * WIDTH + b]:
                size, x = w[p[4] * WIDTH + b], (p[2] + 2 * n) * WIDTH + b
                column, row = random.normal_pair(seed, runs[b], step, p[7] + 1, n)
                w[x] += size * column
                w[x + WIDTH] += size * row


@stage
def quantise(p, w, step):
    """Round rows to whole multiples of a step, in place: (every, count, rows, step)."""
    if step % p[0]:
        return
    size = get(w, p[3])
    for i in range(p[1]):
        put(w, p[2] + i, in_steps(get(w, p[2] + i), size))


@stage
def lose(p, w, step):
    """Mark the image of this step as lost by chance: (every, share, seed, run, stream, out)."""
    if step % p[0]:
        return
    runs = unsigned(w, p[3])
    for b in range(WIDTH):
        if random.uniform(np.uint64(p[2]), runs[b], step, p[4], 0) < w[p[1] * WIDTH + b]:
            w[p[5] * WIDTH + b] = 1.0
