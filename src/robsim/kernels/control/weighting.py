"""Stages of the weights of marks, and of the numbers that a feature makes of them.

A weight is 0 where a mark is not there or is not to count, 1 where it counts in full, and goes from
one to the other by the polynomial 6 x^5 - 15 x^4 + 10 x^3, which is twice differentiable.
"""

import numpy as np

from robsim.kernels.formulas.camera import IN_IMAGE, OUT_OF_IMAGE
from robsim.kernels.formulas.timing import quintic
from robsim.kernels.images.viewing import BORDER
from robsim.kernels.linear_algebra.solve import solve_block
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import absolute, get, put, some, where
from robsim.kernels.machine.stage import stage


@part
def _smooth(x):
    """Return the share from 0 at x = 0 to 1 at x = 1, constant beyond, and 0 where x is NaN."""
    x = where(x > 0.0, x, 0.0)
    return quintic(where(x < 1.0, x, 1.0))[0]


@stage
def there(p, w, step):
    """Compute 1 for marks that are measured in the image, else 0: (N, pixels, points, camera, out).

    Then the rows of whether they are hidden, or -1. A pixel without a direction is not measured.
    """
    b = p[3] + BORDER
    for n in range(p[0]):
        u, v = get(w, p[1] + 2 * n), get(w, p[1] + 2 * n + 1)
        x = get(w, p[2] + 2 * n) + get(w, p[2] + 2 * n + 1)
        inside = (u >= get(w, b)) & (u < get(w, b + 1)) & (v >= get(w, b + 2))
        inside = inside & (v < get(w, b + 3)) & (absolute(x) < np.inf)
        found = where(inside, 1.0, 0.0)
        if p[5] >= 0:
            found = where(get(w, p[5] + n) > 0.0, 0.0, found)
        put(w, p[4] + n, found)


@stage
def border(p, w, step):
    """Compute the weights of marks by their way to the border: (N, pixels, camera, width, out).

    It is the product of a share for each of the four sides, each 1 from `width` pixels on.
    """
    b, width = p[2] + BORDER, get(w, p[3])
    for n in range(p[0]):
        u, v = get(w, p[1] + 2 * n), get(w, p[1] + 2 * n + 1)
        across = _smooth((u - get(w, b)) / width) * _smooth((get(w, b + 1) - u) / width)
        down = _smooth((v - get(w, b + 2)) / width) * _smooth((get(w, b + 3) - v) / width)
        put(w, p[4] + n, across * down)


@stage
def fade(p, w, step):
    """Compute the weights of marks that come and go within a time: (N, there, time, dt, ramp, out).

    At the start those that are there count in full. The ramps are kept from step to step.
    """
    change = get(w, p[3]) / get(w, p[2])
    for n in range(p[0]):
        here = get(w, p[1] + n)
        now = get(w, p[4] + n) if step > 0 else here
        now = now + where(here > 0.0, change, -change)
        now = where(now > 0.0, now, 0.0)
        now = where(now < 1.0, now, 1.0)
        put(w, p[4] + n, now)
        put(w, p[5] + n, _smooth(now))


@stage
def least(p, w, step):
    """Compute the smallest weight of the marks that each number depends on: (k, weights).

    Then of each number: on how many marks it depends, and the rows of their weights.
    """
    at = 2
    for i in range(p[0]):
        found = get(w, p[at + 1])
        for j in range(1, p[at]):
            other = get(w, p[at + 1 + j])
            found = where(other < found, other, found)
        put(w, p[1] + i, found)
        at += 1 + p[at]


@stage
def enough(p, w, step):
    """Compute k weights: 1 where enough marks are there, else 0: (k, out, enough, marks).

    Then the rows of the weights of so many marks.
    """
    count = 0.0 * get(w, p[4])
    for n in range(p[3]):
        count = count + where(get(w, p[4 + n]) > 0.0, 1.0, 0.0)
    for i in range(p[0]):
        put(w, p[1] + i, where(count >= 1.0 * p[2], 1.0, 0.0))


@stage
def unused(p, w, step):
    """Compute 1 for numbers of weight 0, else 0: (k, weights, out)."""
    for i in range(p[0]):
        put(w, p[2] + i, where(get(w, p[1] + i) > 0.0, 0.0, 1.0))


@stage
def few(p, w, step):
    """Compute whether too little is left to command: (k, n, A, moves, weights, needed, rcond, ...).

    Then how many marks are needed, the status, zeros, room, the number of images, and of each the
    number of its marks and the rows of their weights. The status is that of a mark out of the image
    where fewer marks are in use than needed; or where numbers are not, and the rank of A = L J is
    below the needed one and that of J, where `moves` is the row of J (see `solve_block`).
    """
    k, n, moves, rcond, zeros, room = p[0], p[1], p[3], get(w, p[6]), p[9], p[10]
    unused = 0.0 * rcond
    for i in range(k):
        unused = where(get(w, p[4] + i) > 0.0, unused, 1.0)
    count = 0.0 * rcond
    for i in range(p[11]):
        for m in range(p[12 + 2 * i]):
            count = count + where(get(w, p[13 + 2 * i] + m) > 0.0, 1.0, 0.0)
    lost = count < 1.0 * p[7]
    if some(unused > 0.0):
        rank = solve_block(w, p[2], k, n, zeros, -1, rcond, room, moves, room + n)
        needed = get(w, p[5])
        if moves >= 0:
            of_J = solve_block(w, moves, 6, n, zeros, -1, rcond, room, moves, room + n)
            needed = where(of_J < needed, of_J, needed)
        lost = lost | ((unused > 0.0) & (rank < needed))
    put(w, p[8], where(lost, 1.0 * OUT_OF_IMAGE, 1.0 * IN_IMAGE))


@stage
def worst(p, w, step):
    """Compute the largest of some rows: (how many, out), and the rows."""
    found = get(w, p[2])
    for i in range(1, p[0]):
        other = get(w, p[2 + i])
        found = where(other > found, other, found)
    put(w, p[1], found)
