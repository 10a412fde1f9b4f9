"""Stages of the errors of an image: noise, mismatched marks, pixels, and lost images.

Their first number is the count of periods from one image to the next: between them nothing is done.
Standard deviations, shares and steps stand in rows, of each run its own.
"""

import numpy as np

from robsim.kernels.formulas import random
from robsim.kernels.formulas.quantiser import round_to_step
from robsim.kernels.machine.array_views import matrix, unsigned_row
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage


@stage
def add_pixel_noise(
    w,
    step,
    every="whole",
    N="count",
    pixels="N, 2",
    sigma="row",
    seed="whole",
    run="row",
    stream="whole",
    out="N, 2",
):
    """Compute pixels with Gaussian noise: (every, marks, pixels, sigma, seed, run, out)."""
    if step % every:
        return
    normal, sigma = matrix(w, out, N, 2), get(w, sigma)
    random.fill_normal_pairs(np.uint64(seed), unsigned_row(w, run), step, stream, normal)
    for i in range(2 * N):
        put(w, out + i, get(w, pixels + i) + sigma * get(w, out + i))


@stage
def mismatch_marks(
    w,
    step,
    every="whole",
    N="count",
    pixels="N, 2",
    share="row",
    deviation="row",
    seed="whole",
    run="row",
    stream="whole",
):
    """Add size times a standard normal to both coordinates of a share of the marks, in place.

    (every, marks, pixels, share, size, seed, run)
    """
    if step % every:
        return
    seed, runs = np.uint64(seed), unsigned_row(w, run)
    for n in range(N):
        for b in range(WIDTH):
            if random.uniform_number(seed, runs[b], step, stream, n) < w[share * WIDTH + b]:
                size, x = w[deviation * WIDTH + b], (pixels + 2 * n) * WIDTH + b
                column, row = random.normal_pair(seed, runs[b], step, stream + 1, n)
                w[x] += size * column
                w[x + WIDTH] += size * row


@stage
def quantise_rows(w, step, every="whole", n="count", values="n", size="row"):
    """Round rows to whole multiples of a step, in place: (every, count, rows, step)."""
    if step % every:
        return
    size = get(w, size)
    for i in range(n):
        put(w, values + i, round_to_step(get(w, values + i), size))


@stage
def lose_image(
    w, step, every="whole", share="row", seed="whole", run="row", stream="whole", out="row"
):
    """Mark the image of this step as lost by chance: (every, share, seed, run, out)."""
    if step % every:
        return
    runs = unsigned_row(w, run)
    for b in range(WIDTH):
        if random.uniform_number(np.uint64(seed), runs[b], step, stream, 0) < w[share * WIDTH + b]:
            w[out * WIDTH + b] = 1.0
