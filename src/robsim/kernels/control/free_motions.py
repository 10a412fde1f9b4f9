"""Motions that tasks leave free: the projector onto these motions, and projected secondary motions.

`robsim.kernels.control.task_priorities` finds a basis of the free motions, the columns of N, or the
projector P in the runs without a basis.
"""

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import any_lane, get, put, where
from robsim.kernels.machine.stages import stage


@kernel
def put_projector(w, n, N, free, has_basis, P):
    """Compute P = N N' in the runs of the mask `has_basis`."""
    for i in range(n):
        for j in range(i + 1):
            total = 0.0 * get(w, N)
            for c in range(free):
                total = total + get(w, N + n * c + i) * get(w, N + n * c + j)
            put(w, P + n * i + j, where(has_basis, total, get(w, P + n * i + j)))
            put(w, P + n * j + i, where(has_basis, total, get(w, P + n * j + i)))


@stage
def compute_projector(w, step, n="count", N="n, n", free="whole", usual="row", P="n, n"):
    """Compute the projector P onto the free motions in the runs with usual = 1.

    The first `free` columns of N, stored in column-major order, are a basis. The other runs have P.
    """
    put_projector(w, n, N, free, get(w, usual) > 0.0, P)


@part
def _add_components(w, n, rows, count, x, out):
    """Add r r'x to `out` for each of `count` rows r (n,)."""
    for c in range(count):
        r = rows + n * c
        along = get(w, r) * get(w, x)
        for i in range(1, n):
            along = along + get(w, r + i) * get(w, x + i)
        for i in range(n):
            put(w, out + i, get(w, out + i) + along * get(w, r + i))


@part
def project_motion(w, n, P, motion, i):
    """Return component i of P motion."""
    total = 0.0 * get(w, P)
    for j in range(n):
        total = total + get(w, P + n * i + j) * get(w, motion + j)
    return total


@stage
def add_free_motion(
    w, step, n="count", N="n, n", free="whole", usual="row", P="n, n", motion="n", qd="n", out="n"
):
    """Add a secondary motion, projected onto the free motions, to the command qd.

    See `compute_projector` for N and P.
    """
    for i in range(n):
        put(w, out + i, 0.0 * get(w, motion + i))
    _add_components(w, n, N, free, motion, out)
    has_basis = get(w, usual) > 0.0
    any_projector = any_lane(~has_basis)
    for i in range(n):
        projected = get(w, out + i)
        if any_projector:
            projected = where(has_basis, projected, project_motion(w, n, P, motion, i))
        put(w, out + i, get(w, qd + i) + projected)
