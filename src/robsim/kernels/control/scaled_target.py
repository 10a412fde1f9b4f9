"""Problem of a command that keeps the direction of a target, if need be at a lower speed.

The unknowns are the command qd and a share s of the target. With a = tr(A'A)/n, they minimise

    ||A (qd - s target)||^2 + joint_weight a ||qd - s target||^2
        + slow_weight ||A target||^2 (1 - s)^2,  0 <= s <= 1,

within the bounds of qd. A target outside of its bounds is slowed, so that the features keep their
path. If its direction is excluded, as at the limit of a joint, the command deviates from it.
"""

from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put, sqrt
from robsim.kernels.machine.stages import stage


@stage
def scale_target(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    target="n",
    low="n",
    high="n",
    weights="2",
    rows="r, p",
    r="count",
    p="count",
    wish="p",
    least="p",
    most="p",
):
    """Compute the matrix `rows` (k + n + 1, n + 1), the wish (target, 1), and its bounds.

    The cost of (qd, s) is ||rows ((qd, s) - wish)||^2. `weights` holds joint_weight, slow_weight.
    """
    zero = 0.0 * get(w, weights)
    for i in range(r * p):
        put(w, rows + i, zero)
    square, trace = _write_error_rows(w, A, k, n, target, rows, p, zero)
    size = sqrt(get(w, weights) * trace / n)
    for j in range(n):
        velocity, row = get(w, target + j), rows + (k + j) * p
        put(w, row + j, size)
        put(w, row + n, -size * velocity)
        square = square + size * velocity * (size * velocity)
        put(w, wish + j, velocity)
        put(w, least + j, get(w, low + j))
        put(w, most + j, get(w, high + j))
    put(w, rows + (k + n) * p + n, sqrt(get(w, weights + 1) * square))
    put(w, wish + n, 1.0)
    put(w, least + n, 0.0)
    put(w, most + n, 1.0)


@part
def _write_error_rows(w, A, k, n, target, rows, p, zero):
    """Write the rows of the change of the error. Return ||A target||^2 and tr A'A."""
    square, trace = zero, zero
    for i in range(k):
        rate = zero
        for j in range(n):
            a = get(w, A + i * n + j)
            put(w, rows + i * p + j, a)
            trace = trace + a * a
            rate = rate + a * get(w, target + j)
        put(w, rows + i * p + n, -rate)
        square = square + rate * rate
    return square, trace
