"""Columns of matrices in registers. Eight rows at a time are read before any row is written.

The compiler cannot prove that two columns of a block do not overlap. If reads and writes alternate,
it must reload one column after each number that is written to the other column.
"""

from robsim.kernels.machine.intrinsics import fragment
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put

HEIGHT = 8  # rows; two columns and a sum fit into the registers of AVX-512


@part
def padded_height(rows):
    """Return a number of rows rounded up to a multiple of HEIGHT."""
    return -(-rows // HEIGHT) * HEIGHT


@fragment
def load_column(block, at):
    """Return eight rows of a block."""
    return (
        get(block, at), get(block, at + 1), get(block, at + 2), get(block, at + 3),
        get(block, at + 4), get(block, at + 5), get(block, at + 6), get(block, at + 7),
    )  # fmt: skip


@fragment
def dot_columns(a, b):
    """Return the dot product of two columns, summed pairwise for short dependency chains."""
    low = (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
    return low + ((a[4] * b[4] + a[5] * b[5]) + (a[6] * b[6] + a[7] * b[7]))


@fragment
def put_difference(block, at, a, b, share):
    """Write a - share b to eight rows at `at`."""
    put(block, at, a[0] - share * b[0])
    put(block, at + 1, a[1] - share * b[1])
    put(block, at + 2, a[2] - share * b[2])
    put(block, at + 3, a[3] - share * b[3])
    put(block, at + 4, a[4] - share * b[4])
    put(block, at + 5, a[5] - share * b[5])
    put(block, at + 6, a[6] - share * b[6])
    put(block, at + 7, a[7] - share * b[7])
