"""Adaptive gains, which depend on the size of the error. The run is the last axis."""

import math

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel


@kernel
def gain_at(at_zero, at_infinity, slope, size):
    """Return the gain (g0 - g1) exp(-slope x/(g0 - g1)) + g1 at a size x, with g0 > g1."""
    span = at_zero - at_infinity
    return span * math.exp(-slope * size / span) + at_infinity


@entry("float64, float64, float64, float64[::1], out float64[::1]")
def compute_gains(at_zero, at_infinity, slope, norm, gain):
    """Compute gain[b] at x = norm[b]."""
    for b in range(norm.size):
        gain[b] = gain_at(at_zero, at_infinity, slope, norm[b])
