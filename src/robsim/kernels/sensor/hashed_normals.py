"""Normal numbers of pixels, each a function of (seed, run, step, pixel) alone.

A counter is hashed by the output function of SplitMix64 (Steele, Lea, Flood, "Fast splittable
pseudorandom number generators", OOPSLA 2014), and parts of the hash select entries of a table of
normal quantiles. A number takes a quarter of the time of Philox with the method of Box and Muller
(`kernels.formulas.random`), which serves the few numbers of marks and joints.
"""

import numpy as np

from robsim.kernels.machine.kernel import kernel, part

TABLE_BITS = 12
_INCREMENT = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_MASK = np.uint64(2**TABLE_BITS - 1)
_S27, _S30, _S31 = np.uint64(27), np.uint64(30), np.uint64(31)
_BITS, _TWICE, _THRICE = (np.uint64(k * TABLE_BITS) for k in (1, 2, 3))


@kernel
def hash_counter(z):
    """Return the output of SplitMix64 for a state."""
    z = (z ^ (z >> _S30)) * _FIRST
    z = (z ^ (z >> _S27)) * _SECOND
    return z ^ (z >> _S31)


@kernel
def find_image_key(seed, run, step):
    """Return the hash of (seed, run, step): the state before the first pixel of an image."""
    key = hash_counter(np.uint64(seed) + _INCREMENT)
    key = hash_counter(key ^ (np.uint64(run) * _INCREMENT + _FIRST))
    return hash_counter(key ^ (np.uint64(step) * _INCREMENT + _SECOND))


@part
def fill_normal_row(key, y, table, words, out):
    """Compute the normal numbers out (w,) of row y.

    Each number is the sum of two entries of `table` (4096,), and each hash gives two numbers.
    `words` (at least w / 2,) are a buffer: hashes need no table, so they are computed in registers
    of many numbers.
    """
    width, pairs = out.size, out.size // 2
    count = width - pairs
    first = key + _INCREMENT * np.uint64(y * count + 1)
    for i in range(count):
        words[i] = hash_counter(first + _INCREMENT * np.uint64(i))
    for i in range(pairs):
        z = words[i]
        out[2 * i] = table[z & _MASK] + table[(z >> _BITS) & _MASK]
        out[2 * i + 1] = table[(z >> _TWICE) & _MASK] + table[(z >> _THRICE) & _MASK]
    if width > 2 * pairs:
        z = words[pairs]
        out[width - 1] = table[z & _MASK] + table[(z >> _BITS) & _MASK]
