"""Damping of an error that acts as normal equations of a camera twist."""

from robsim.kernels.machine.lanes import get, put, sqrt, where
from robsim.kernels.machine.stages import stage

LEAST_PIVOT = 1e-9  # share of a diagonal element below which its direction counts as free


@stage
def damp_normal_rows(
    w, step, error="k", k="count", L="k, 6", damping="row", damped_error="k", damped_L="k, 6"
):
    """Compute an error and an L with the step (H + damping diag(H))^-1 g.

    H = L'L and g = L'e are those of an upper triangular L [R; 0] and an error e; the result has the
    same form. It is the step of Levenberg and Marquardt, with the diagonal of Marquardt (1963).
    """
    factor = 1.0 + get(w, damping)
    zero = 0.0 * factor
    for i in range(6):
        rest, square = zero, zero
        for m in range(i + 1):
            rest = rest + get(w, L + 6 * m + i) * get(w, error + m)
            square = square + get(w, L + 6 * m + i) * get(w, L + 6 * m + i)
        pivot = square * factor
        for m in range(i):
            pivot = pivot - get(w, damped_L + 6 * m + i) * get(w, damped_L + 6 * m + i)
            rest = rest - get(w, damped_L + 6 * m + i) * get(w, damped_error + m)
        found = pivot > LEAST_PIVOT * square
        inverse = where(found, 1.0 / sqrt(where(found, pivot, 1.0)), zero)
        put(w, damped_error + i, rest * inverse)
        for j in range(i):
            put(w, damped_L + 6 * i + j, zero)
        put(w, damped_L + 6 * i + i, where(found, pivot * inverse, zero))
        for j in range(i + 1, 6):
            entry = zero
            for m in range(i + 1):
                entry = entry + get(w, L + 6 * m + i) * get(w, L + 6 * m + j)
            for m in range(i):
                entry = entry - get(w, damped_L + 6 * m + i) * get(w, damped_L + 6 * m + j)
            put(w, damped_L + 6 * i + j, entry * inverse)
    for i in range(6, k):
        put(w, damped_error + i, get(w, error + i))
        for j in range(6):
            put(w, damped_L + 6 * i + j, zero)
