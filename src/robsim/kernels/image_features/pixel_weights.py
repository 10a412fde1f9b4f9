"""Robust weights of the differences of pixels."""

import numpy as np

from robsim.kernels.machine.jit import kernel

BINS = 1024  # of the histogram of differences, of a quarter of a grey value each
TUKEY = 4.6851  # tuning constant of the biweight, for 95 % efficiency with normal errors
TO_DEVIATION = 1.4826  # standard deviation over median of the magnitudes of normal numbers
LEAST_SHARE = 0.25  # of the contrast at the goal: smaller differences are those of a small motion


@kernel
def weigh_differences(error, count, contrast, weights):
    """Compute the weights (N,) of Tukey's biweight of the first `count` differences.

    The weight of a difference e is (1 - (e / (4.685 sigma))^2)^2, and 0 beyond 4.685 sigma. The
    standard deviation sigma is estimated from the median of |e| in steps of a quarter of a grey
    value, and is at least a quarter of the contrast: most pixels of a plain background are equal.
    Return the sum of the weights.
    """
    bins = np.zeros(BINS, dtype=np.int64)
    for i in range(count):
        bins[min(int(4.0 * abs(error[i])), BINS - 1)] += 1
    below, middle = 0, 0
    while 2 * (below + bins[middle]) < count:
        below += bins[middle]
        middle += 1
    deviation = max(TO_DEVIATION * (middle + 0.5) / 4.0, LEAST_SHARE * contrast)
    scale, total = 1.0 / (TUKEY * deviation), 0.0
    for i in range(weights.size):
        share = (error[i] * scale) ** 2 if i < count else 1.0
        weights[i] = (1.0 - share) ** 2 if share < 1.0 else 0.0
        total += weights[i]
    return total
