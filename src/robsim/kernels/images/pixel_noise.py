"""Stages of image errors: pixel noise, mismatched marks, quantisation, and lost images.

`every` is the number of periods between two images. Between images the stages do nothing. Standard
deviations, shares and steps are rows and may differ between runs.
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
    """Compute out, the pixels with Gaussian noise of standard deviation sigma."""
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
    """Add normal errors of standard deviation `deviation` to the pixels of some marks, in place.

    A mark is affected with probability `share`.
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
    """Round n rows to multiples of a step, in place."""
    if step % every:
        return
    size = get(w, size)
    for i in range(n):
        put(w, values + i, round_to_step(get(w, values + i), size))


@stage
def lose_image(
    w, step, every="whole", share="row", seed="whole", run="row", stream="whole", out="row"
):
    """Set `out` to 1 with probability `share`, to flag the image of this step as lost."""
    if step % every:
        return
    runs = unsigned_row(w, run)
    for b in range(WIDTH):
        if random.uniform_number(np.uint64(seed), runs[b], step, stream, 0) < w[share * WIDTH + b]:
            w[out * WIDTH + b] = 1.0
