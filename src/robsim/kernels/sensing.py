"""The errors of an image besides Gaussian noise."""

import numpy as np

from robsim.kernels import random
from robsim.kernels.jit import kernel
from robsim.kernels.steps import in_steps

OUTLIERS, AWAY, DROPPED = 1, 2, 3  # streams of random numbers; that of the noise is 0


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
