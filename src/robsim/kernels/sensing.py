"""The errors of an image besides Gaussian noise."""

import numpy as np

from robsim.kernels import random
from robsim.kernels.jit import kernel
from robsim.kernels.lanes import get, put
from robsim.kernels.memory import matrix, unsigned
from robsim.kernels.stage import stage
from robsim.kernels.steps import in_steps

NOISE, OUTLIERS, AWAY, DROPPED = 0, 1, 2, 3  # streams of random numbers


@kernel
def disturb(pixels, sigma, seed, runs, step, out):
    """Compute out = pixels[n, 2, b] with Gaussian noise of this standard deviation."""
    if sigma > 0.0:
        random.normal_pairs(seed, runs, step, NOISE, out)
    for n in range(out.shape[0]):
        for r in range(2):
            for b in range(out.shape[2]):
                extra = sigma * out[n, r, b] if sigma > 0.0 else 0.0
                out[n, r, b] = pixels[n, r, b] + extra


@stage
def blur(p, w, step):
    """Compute pixels with Gaussian noise: (marks, pixels, sigma, seed, run, out)."""
    normal, sigma = matrix(w, p[5], p[0], 2), get(w, p[2])
    random.normal_pairs(np.uint64(p[3]), unsigned(w, p[4]), step, NOISE, normal)
    for i in range(2 * p[0]):
        put(w, p[5] + i, get(w, p[1] + i) + sigma * get(w, p[5] + i))


@kernel
def displace(share, size, seed, runs, step, pixels):
    """Add size times a standard normal to both coordinates of a share of pixels[n, 2, b]."""
    chance, away = np.empty((pixels.shape[0], runs.size)), np.empty(pixels.shape)
    random.uniforms(seed, runs, step, OUTLIERS, chance)
    random.normal_pairs(seed, runs, step, AWAY, away)
    for n in range(pixels.shape[0]):
        for r in range(2):
            for b in range(runs.size):
                if chance[n, b] < share:
                    pixels[n, r, b] += size * away[n, r, b]


@kernel
def quantise(size, pixels):
    """Round pixels[n, 2, b] to whole multiples of size."""
    for n in range(pixels.shape[0]):
        for r in range(2):
            for b in range(pixels.shape[2]):
                pixels[n, r, b] = in_steps(pixels[n, r, b], size)


@kernel
def lost(share, seed, runs, step, out):
    """Compute out[b]: whether the image of this step is lost."""
    chance = np.empty((1, runs.size))
    random.uniforms(seed, runs, step, DROPPED, chance)
    for b in range(runs.size):
        out[b] = chance[0, b] < share
