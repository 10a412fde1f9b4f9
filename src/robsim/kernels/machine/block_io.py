"""Copies between run-last arrays and rows of a block, which hold one number of WIDTH runs.

If fewer than WIDTH runs remain, copies of the last run fill the remaining lanes.
"""

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH


@part
def gather_row(source, b, row, block):
    """Copy source[b...] into a row of a block."""
    first = row * WIDTH
    if b + WIDTH <= source.size:
        for lane in range(WIDTH):
            block[first + lane] = source[b + lane]
    else:
        for lane in range(WIDTH):
            block[first + lane] = source[min(b + lane, source.size - 1)]


@kernel
def gather_rows(x, b, row, block):
    """Copy x[i, b...] into rows of a block."""
    for i in range(x.shape[0]):
        gather_row(x[i], b, row + i, block)


@part
def scatter_row(block, row, b, out):
    """Copy a row of a block to out[b...]."""
    first = row * WIDTH
    for lane in range(min(WIDTH, out.size - b)):
        out[b + lane] = block[first + lane]


@kernel
def scatter_rows(block, row, b, x):
    """Copy rows of a block to x[i, b...]."""
    for i in range(x.shape[0]):
        scatter_row(block, row + i, b, x[i])
