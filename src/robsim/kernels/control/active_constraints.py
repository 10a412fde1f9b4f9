"""Factors of the active constraints of a quadratic program.

With H = L L', the columns of J = L^-T Q are orthonormal in the metric of H. The first q columns
span the steps along the gradients of the q active constraints, the others are free. The matrix T
maps the coordinates of a gradient in the first q columns to its shares of the active gradients.
A reflection of columns adds or removes a constraint: it costs two products of vectors.

J is stored by columns and by rows, and T by columns, so that all products are sums of vectors.
"""

import math

from robsim.kernels.control.quadratic_layout import (
    ACTIVE,
    COLUMNS,
    COMBINATIONS,
    DUAL,
    FREE,
    METRIC,
    PLACES,
    PRICES,
    ROWS,
    SHARES,
    STEP,
    columns_at,
    count_blocks,
    matrices_at,
)
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, get, put, where

INDEPENDENT = 1e-20  # least squared share of a gradient outside of the active gradients
ROUNDING = 1e-26  # rounding errors of this squared share, relative to the squared size of J


@routine
def factorise_metric(w, first, n):
    """Compute J = L^-T for H = L L', and overwrite H. Return the squared size of J.

    The elimination of [H, I] gives [D L', L^-1] with unit diagonals of L, without square roots.
    """
    wide, H = count_blocks(n), matrices_at(first, n) + METRIC * n * count_blocks(n)
    J = matrices_at(first, n) + COLUMNS * n * wide
    for i in range(n):
        w[(J + i * wide) * WIDTH + i] = 1.0
    for j in range(n):
        inverse = 1.0 / w[(H + j * wide) * WIDTH + j]
        for i in range(j + 1, n):
            factor, here, pivot = w[(H + i * wide) * WIDTH + j] * inverse, i * wide, j * wide
            for v in range(wide):
                put(w, H + here + v, get(w, H + here + v) - factor * get(w, H + pivot + v))
                put(w, J + here + v, get(w, J + here + v) - factor * get(w, J + pivot + v))
    return _scale_columns(w, first, n)


@part
def _scale_columns(w, first, n):
    """Scale the columns of J by the roots of the pivots, and store the rows of J."""
    wide, matrices, square = count_blocks(n), matrices_at(first, n), 0.0
    H, J = matrices + METRIC * n * wide, matrices + COLUMNS * n * wide
    rows = matrices + ROWS * n * wide
    for i in range(n):
        factor = 1.0 / math.sqrt(w[(H + i * wide) * WIDTH + i])
        for v in range(wide):
            put(w, J + i * wide + v, get(w, J + i * wide + v) * factor)
        for j in range(n):
            x = w[(J + i * wide) * WIDTH + j]
            w[(rows + j * wide) * WIDTH + i] = x
            square += x * x
    return square


@routine
def project_gradient(w, first, n, m, p, q, spread):
    """Compute the coordinates of gradient p, its free direction, and its shares.

    These are the vectors DUAL, STEP and SHARES. FREE holds the free coordinates. `spread` is the
    squared size of J. Return the squared length of the free direction in the metric of H, or 0 if
    it is not significant.
    """
    wide, matrices = count_blocks(n), matrices_at(first, n)
    J, T = matrices + COLUMNS * n * wide, matrices + COMBINATIONS * n * wide
    _compute_coordinates(w, first, n, m, p, q)
    dual, free_at = (first + DUAL * wide) * WIDTH, (first + FREE * wide) * WIDTH
    whole, free = 0.0, 0.0
    for k in range(n):
        whole += w[dual + k] * w[dual + k]
        free += w[free_at + k] * w[free_at + k]
    for v in range(wide):
        step, share = 0.0 * get(w, J), 0.0 * get(w, J)
        for k in range(n):
            step = step + w[free_at + k] * get(w, J + k * wide + v)
            share = share + w[dual + k] * get(w, T + k * wide + v)
        put(w, first + STEP * wide + v, step)
        put(w, first + SHARES * wide + v, share)
    return free if free > INDEPENDENT * whole + ROUNDING * spread else 0.0


@part
def _compute_coordinates(w, first, n, m, p, q):
    """Compute the coordinates J' c of the gradient c of constraint p, and their free part."""
    wide, tall = count_blocks(n), count_blocks(m)
    rows = matrices_at(first, n) + ROWS * n * wide
    c = columns_at(first, n, m) * WIDTH + p - 2 * n
    for v in range(wide):
        total = 0.0 * get(w, rows)
        if p < n:
            total = get(w, rows + p * wide + v)
        elif p < 2 * n:
            total = -get(w, rows + (p - n) * wide + v)
        else:
            for k in range(n):
                total = total + w[c + k * tall * WIDTH] * get(w, rows + k * wide + v)
        put(w, first + DUAL * wide + v, total)
        free = where(get(w, first + PLACES * wide + v) < q, 0.0, total)
        put(w, first + FREE * wide + v, free)


@routine
def add_active(w, first, n, p, q, price, free):
    """Add constraint p with its multiplier as active constraint q.

    The reflection maps the free coordinates of its gradient to column q of J. `free` is their
    squared length.
    """
    wide = count_blocks(n)
    across, step = first + FREE * wide, first + STEP * wide
    J = matrices_at(first, n) + COLUMNS * n * wide
    T = matrices_at(first, n) + COMBINATIONS * n * wide
    own = w[across * WIDTH + q]
    length = math.copysign(math.sqrt(free), own)
    factor, inverse = 1.0 / (free + length * own), 1.0 / length
    for v in range(wide):
        place, d = get(w, first + PLACES * wide + v), get(w, across + v)
        share = inverse * get(w, first + SHARES * wide + v)
        put(w, T + q * wide + v, where(place == q, -inverse, share))
        put(w, across + v, where(place == q, d + length, d))
        put(w, step + v, factor * (get(w, step + v) + length * get(w, J + q * wide + v)))
    _reflect_columns(w, first, n)
    w[(first + PRICES * wide) * WIDTH + q] = price
    w[(first + ACTIVE * wide) * WIDTH + q] = p


@routine
def _reflect_columns(w, first, n):
    """Subtract y v' from J, with y in the vector STEP and v in the vector FREE."""
    wide, matrices = count_blocks(n), matrices_at(first, n)
    J, rows = matrices + COLUMNS * n * wide, matrices + ROWS * n * wide
    across, step = first + FREE * wide, first + STEP * wide
    for v in range(wide):
        y, d = get(w, step + v), get(w, across + v)
        for k in range(n):
            put(w, J + k * wide + v, get(w, J + k * wide + v) - w[across * WIDTH + k] * y)
            put(w, rows + k * wide + v, get(w, rows + k * wide + v) - w[step * WIDTH + k] * d)


@routine
def remove_active(w, first, n, leaving, q):
    """Remove one of q active constraints. The last active constraint takes its place.

    The reflection maps row `leaving` of T to a multiple of the last active column of J, which
    becomes free.
    """
    wide, last = count_blocks(n), q - 1
    T = (matrices_at(first, n) + COMBINATIONS * n * wide) * WIDTH
    active, prices = (first + ACTIVE * wide) * WIDTH, (first + PRICES * wide) * WIDTH
    _reflect_combinations(w, first, n, leaving, q)
    _reflect_columns(w, first, n)
    for k in range(last):
        w[T + k * wide * WIDTH + leaving] = w[T + k * wide * WIDTH + last]
        w[T + k * wide * WIDTH + last] = 0.0
    for i in range(wide * WIDTH):
        w[T + last * wide * WIDTH + i] = 0.0
    w[active + leaving], w[prices + leaving] = w[active + last], w[prices + last]
    w[prices + last] = 0.0


@part
def _reflect_combinations(w, first, n, leaving, q):
    """Compute the reflection that removes a constraint, and apply it to the columns of T."""
    wide, last = count_blocks(n), q - 1
    across, step = (first + FREE * wide) * WIDTH, first + STEP * wide
    J = matrices_at(first, n) + COLUMNS * n * wide
    T = matrices_at(first, n) + COMBINATIONS * n * wide
    square = 0.0
    for k in range(n):  # columns of T from q on are zero
        w[across + k] = w[(T + k * wide) * WIDTH + leaving]
        square += w[across + k] * w[across + k]
    length = math.copysign(math.sqrt(square), w[across + last])
    factor = 1.0 / (square + length * w[across + last])
    w[across + last] += length
    for v in range(wide):
        total, others = 0.0 * get(w, J), 0.0 * get(w, J)
        for k in range(n):
            total = total + w[across + k] * get(w, J + k * wide + v)
            others = others + w[across + k] * get(w, T + k * wide + v)
        put(w, step + v, factor * total)
        for k in range(n):
            here = T + k * wide + v
            put(w, here, get(w, here) - factor * w[across + k] * others)
