"""Damped least squares by normal equations and Cholesky factorisation, on blocks of runs.

This is faster than `robsim.kernels.linear_algebra.pseudoinverse` and suitable for damped steps. The
normal equations square the condition number, so they are not suitable for nearly singular systems
without damping.
"""

from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put, sqrt
from robsim.kernels.machine.stages import stage


@part
def _damped_gram(w, A, k, n, damping, H):
    """Compute the lower half of H[m, m] = A'A, or of the smaller A A', plus damping I."""
    m, apart, along = (k, n, 1) if k < n else (n, 1, n)
    for i in range(m):
        for j in range(i + 1):
            a, b = A + i * apart, A + j * apart
            total = (1.0 if i == j else 0.0) * damping
            for r in range(max(k, n)):
                total = total + get(w, a + r * along) * get(w, b + r * along)
            put(w, H + m * i + j, total)


@part
def _factorise_cholesky(w, H, m):
    """Replace the lower half of H by L with H = L L', in place. The diagonal holds 1 / L_jj."""
    for j in range(m):
        for i in range(j, m):
            total = get(w, H + m * i + j)
            for k in range(j):
                total = total - get(w, H + m * i + k) * get(w, H + m * j + k)
            if i == j:
                put(w, H + m * i + j, 1.0 / sqrt(total))
            else:
                put(w, H + m * i + j, total * get(w, H + m * j + j))


@part
def _solve_cholesky(w, H, m, x):
    """Replace x by (L L')^-1 x, by forward and back substitution, in place."""
    for i in range(m):
        total = get(w, x + i)
        for k in range(i):
            total = total - get(w, H + m * i + k) * get(w, x + k)
        put(w, x + i, total * get(w, H + m * i + i))
    for i in range(m - 1, -1, -1):
        total = get(w, x + i)
        for k in range(i + 1, m):
            total = total - get(w, H + m * k + i) * get(w, x + k)
        put(w, x + i, total * get(w, H + m * i + i))


def count_damped_step_rows(k: int, n: int) -> int:
    """Return the number of scratch rows that `damped_step` needs."""
    m = min(k, n)
    return m * m + m


@stage
def damped_step(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    y="k",
    descent="n",
    damping="row",
    x="n",
    scratch="size",
    size="count",
):
    """Compute x = argmin ||A x - y||^2 + damping ||x||^2, with `descent` = A' y.

    The smaller system of (A'A + damping I)^-1 A' y = A' (A A' + damping I)^-1 y is solved.
    """
    m = min(k, n)
    H, z = scratch, scratch + m * m
    _damped_gram(w, A, k, n, get(w, damping), H)
    _factorise_cholesky(w, H, m)
    for i in range(m):
        put(w, z + i, get(w, (y if k < n else descent) + i))
    _solve_cholesky(w, H, m, z)
    for i in range(n):
        total = get(w, z + (0 if k < n else i))
        if k < n:
            total = total * get(w, A + i)
            for r in range(1, k):
                total = total + get(w, A + n * r + i) * get(w, z + r)
        put(w, x + i, total)
