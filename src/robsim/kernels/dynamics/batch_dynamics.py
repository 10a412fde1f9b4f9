"""Dynamics at many configurations, for run-first arrays of users.

The stages of a program compute one block of runs at a time, so the cost of a configuration does not
depend on their number.
"""

import numpy as np

from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import perform_on_block

USUAL = 1e6  # of coordinates, velocities, accelerations and forces: other numbers may be invalid


@kernel
def _load_rows(x, start, runs, first, block):
    """Copy the runs x[start:] of a flat array to rows of a block; return the largest magnitude.

    If fewer than WIDTH runs remain, copies of the last run fill the block.
    """
    count, usual = x.size // runs, True
    for lane in range(WIDTH):
        at = min(start + lane, runs - 1) * count
        for i in range(count):
            block[(first + i) * WIDTH + lane] = x[at + i]
            usual &= abs(x[at + i]) <= USUAL
    return usual


@kernel
def allocate_block(constants, rows):
    """Return a block of rows that is aligned to vector registers, and starts with constants."""
    memory = np.empty((rows + 1) * WIDTH)
    start = (-memory.ctypes.data) % (8 * WIDTH) // 8
    block = memory[start : start + rows * WIDTH]
    block[: constants.size] = constants
    return block


@kernel
def fill_dynamics(addresses, at, p, constants, rows, output, q, v, a, out):
    """Compute out[run, :] from rows that start at `output`, for flat arrays q, v and a.

    The coordinates q are in the rows from 0, followed by v and a. The constants fill the first
    rows of the block. Return whether all numbers are usual. Python must check unusual numbers.
    """
    block, usual = allocate_block(constants, rows), True
    runs, size = out.shape
    nq, nv = q.size // runs, v.size // runs
    for start in range(0, runs, WIDTH):
        usual = _load_rows(q, start, runs, 0, block) and usual
        usual = _load_rows(v, start, runs, nq, block) and usual
        usual = _load_rows(a, start, runs, nq + nv, block) and usual
        perform_on_block(addresses, at, p, block, 0)
        for lane in range(min(WIDTH, runs - start)):
            for i in range(size):
                out[start + lane, i] = block[(output + i) * WIDTH + lane]
    return usual
