"""Counter-based random numbers. Their bits do not depend on the order, chunks or threads.

The generator is Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1,
2, 3", SC11), checked with the known answers published with Random123. Normal numbers are computed
on lanes without library calls, so their bits are the same on all systems.
"""

import math

import numpy as np

from robsim.kernels.formulas.lane_math import log_of_fraction, near_cos_sin
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, fill_lanes, get, get_lane, put, replace_lane, sqrt

_MASK, _HIGH = np.uint64(0xFFFFFFFF), np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)


@part
def philox(c0, c1, c2, c3, k0, k1):
    """Return four 32-bit words (held in uint64) from a counter of four and a key of two."""
    for _ in range(10):
        p0, p1 = _M0 * (c0 & _MASK), _M1 * (c2 & _MASK)  # masks of factors permit vector registers
        c0, c1, c2, c3 = (p1 >> _HIGH) ^ c1 ^ k0, p1 & _MASK, (p0 >> _HIGH) ^ c3 ^ k1, p0 & _MASK
        k0, k1 = (k0 + _W0) & _MASK, (k1 + _W1) & _MASK
    return c0, c1, c2, c3


@part
def _uniform_double(high, low):
    """Return a double in (0, 1) from 53 bits of two words, half a step away from 0 and 1."""
    return (float(((high << _HIGH) | low) >> np.uint64(11)) + 0.5) * 2.0**-53


@part
def _uniform_pair(seed, run, step, stream, n):
    """Return two uniform numbers in (0, 1), the n-th pair of a run at this step.

    The key is (seed low, run), the counter (step, n, seed high, stream).
    """
    low, high = seed & _MASK, seed >> _HIGH
    w = philox(np.uint64(step), np.uint64(n), high, np.uint64(stream), low, run)
    return _uniform_double(w[0], w[1]), _uniform_double(w[2], w[3])


@part
def _transform_to_normal(first, second):
    """Return normal numbers from uniform numbers, on lanes, by the method of Box and Muller."""
    radius, (c, s) = sqrt(-2.0 * log_of_fraction(first)), near_cos_sin(2.0 * math.pi * second)
    return radius * c, radius * s


@kernel
def normal_pair(seed, run, step, stream, n):
    """Return two independent standard normal numbers, the n-th pair of a run at this step."""
    first, second = _uniform_pair(seed, run, step, stream, n)
    x, y = _transform_to_normal(fill_lanes(first), fill_lanes(second))
    return get_lane(x, 0), get_lane(y, 0)


@kernel
def uniform_number(seed, run, step, stream, n):
    """Return a uniform number in (0, 1), the n-th number of a run at this step.

    It is independent of `normal_pair` if their streams differ.
    """
    return _uniform_pair(seed, run, step, stream, n)[0]


@part
def _load_lanes(x, b):
    """Return the numbers x[b...] as lanes. The lanes after the last number are 1."""
    if b + WIDTH <= x.size:
        return get(x, b // WIDTH)
    lanes = fill_lanes(1.0)
    for i in range(x.size - b):
        lanes = replace_lane(lanes, i, x[b + i])
    return lanes


@part
def _store_lanes(x, b, lanes):
    """Write lanes to x[b...], up to the last number of x."""
    if b + WIDTH <= x.size:
        put(x, b // WIDTH, lanes)
    else:
        for i in range(x.size - b):
            x[b + i] = get_lane(lanes, i)


@entry("uint64, uint64[::1], int64, int64, out float64[:, :, ::1]")
def fill_normal_pairs(seed, runs, step, stream, out):
    """Compute independent standard normal numbers out[n, 2, b] for run runs[b] at this step."""
    for n in range(out.shape[0]):
        for b in range(out.shape[2]):  # whole numbers alone, which the compiler vectorises
            out[n, 0, b], out[n, 1, b] = _uniform_pair(seed, runs[b], step, stream, n)
        x, y = out[n, 0], out[n, 1]
        for b in range(0, x.size, WIDTH):
            first, second = _transform_to_normal(_load_lanes(x, b), _load_lanes(y, b))
            _store_lanes(x, b, first)
            _store_lanes(y, b, second)


@entry("uint64, uint64[::1], int64, int64, out float64[:, ::1]")
def fill_uniform_numbers(seed, runs, step, stream, out):
    """Compute uniform numbers out[n, b] in (0, 1) for run runs[b] at this step."""
    for n in range(out.shape[0]):
        for b in range(out.shape[1]):
            out[n, b] = uniform_number(seed, runs[b], step, stream, n)
