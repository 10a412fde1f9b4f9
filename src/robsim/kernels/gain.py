"""A gain that depends on the size of the error, in the layout with the run last."""

import math

from robsim.kernels.jit import kernel


@kernel
def adaptive(at_zero, at_infinity, slope, norm, gain):
    """Compute gain[b] = (g0 - g1) exp(-slope x/(g0 - g1)) + g1 at x = norm[b], with g0 > g1."""
    span = at_zero - at_infinity
    for b in range(norm.size):
        gain[b] = span * math.exp(-slope * norm[b] / span) + at_infinity
