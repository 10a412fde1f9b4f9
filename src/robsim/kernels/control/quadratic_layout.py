"""Memory of a quadratic program: consecutive rows of a block, WIDTH numbers in each row.

A vector of n numbers takes `wide` rows, and a vector of m numbers takes `tall` rows. The vectors
of n numbers come first, then square matrices, vectors of m numbers, and the columns of C. The rest
of each vector's last row holds numbers that never act.
"""

import math

from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH, put

# vectors of n numbers: the program, its solution, multipliers, and values of the method
WISH, LOW, HIGH, X, LOW_PRICE, HIGH_PRICE = range(6)
LOW_ROOM, HIGH_ROOM, LOW_LIMIT, HIGH_LIMIT = range(6, 10)
STEP, DUAL, FREE, SHARES, PRICES, ACTIVE, PLACES = range(10, 17)
VECTORS = 17
# matrices (n, n), by rows
METRIC, COLUMNS, ROWS, COMBINATIONS = range(4)
MATRICES = 4
# vectors of m numbers
BOUND, PRICE, SCALE, ROOM, LIMIT = range(5)
ROW_VECTORS = 5


def count_quadratic_rows(n: int, m: int) -> int:
    """Return the number of rows that a program of n unknowns and m rows of C needs."""
    wide, tall = -(-n // WIDTH), -(-m // WIDTH)
    return (VECTORS + MATRICES * n) * wide + (ROW_VECTORS + n) * tall


@kernel
def count_blocks(n):
    """Return the number of rows that hold n numbers."""
    return (n + WIDTH - 1) // WIDTH


@kernel
def matrices_at(first, n):
    """Return the first row of the matrices. Each matrix takes n `wide` rows."""
    return first + VECTORS * count_blocks(n)


@kernel
def row_vectors_at(first, n):
    """Return the first row of the vectors of m numbers. Each vector takes `tall` rows."""
    return first + (VECTORS + MATRICES * n) * count_blocks(n)


@kernel
def columns_at(first, n, m):
    """Return the first row of the columns of C. Each column takes `tall` rows."""
    return row_vectors_at(first, n) + ROW_VECTORS * count_blocks(m)


@kernel
def clear_quadratic_program(w, first, n, m):
    """Set a program to zeros without constraints.

    The caller then writes the vectors WISH, LOW and HIGH, the matrix METRIC, the vector BOUND and
    the columns of C.
    """
    wide, tall, bound = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    for i in range(first, bound + (ROW_VECTORS + n) * tall):
        put(w, i, 0.0)
    for v in range(wide):
        put(w, first + LOW * wide + v, -math.inf)
        put(w, first + HIGH * wide + v, math.inf)
    for v in range(bound + BOUND * tall, bound + BOUND * tall + tall):
        put(w, v, -math.inf)
    for i in range(WIDTH * wide):
        w[(first + PLACES * wide) * WIDTH + i] = i
