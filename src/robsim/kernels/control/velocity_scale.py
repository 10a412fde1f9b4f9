"""Scaling of commands to speed limits."""

from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, get, put, sqrt, where
from robsim.kernels.machine.stages import stage


@part
def _twist_speed(w, J, n, first, qd):
    """Return the length of three components of the twist J qd."""
    square = 0.0 * get(w, qd)
    for c in range(first, first + 3):
        V = 0.0 * get(w, qd)
        for j in range(n):
            V = V + get(w, J + n * c + j) * get(w, qd + j)
        square = square + V * V
    return sqrt(square)


@stage
def scale_command(w, step, n="count", J="6, n", limits="n + 2", qd="n", out="n"):
    """Compute out = qd / max(1, speed / limit) over all limited speeds.

    The limits are n limits of |qd|, and the limits of |v| and |omega| of the twist J[6, n] qd.
    """
    excess = 0.0 * get(w, qd) + 1.0
    for h in range(2):
        over = _twist_speed(w, J, n, 3 * h, qd) / get(w, limits + n + h)
        excess = where(over > excess, over, excess)
    for j in range(n):
        over = absolute(get(w, qd + j)) / get(w, limits + j)
        excess = where(over > excess, over, excess)
    for j in range(n):
        put(w, out + j, get(w, qd + j) / excess)
