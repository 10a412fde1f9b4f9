"""Stages that compute s and L of image points, normalised or in pixels."""

from robsim.kernels.formulas.interaction import put_point_rates
from robsim.kernels.formulas.perspective import pinhole_pixel
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage


@stage
def points_stage(w, step, N="count", points="N, 2", depth="N", s="2*N", L="2*N, 6"):
    """Compute s and L of normalised image points."""
    for n in range(N):
        x, y, inverse = get(w, points + 2 * n), get(w, points + 2 * n + 1), 1.0 / get(w, depth + n)
        put(w, s + 2 * n, x)
        put(w, s + 2 * n + 1, y)
        put_point_rates(w, L + 12 * n, x, y, inverse)


@stage
def pixels_stage(w, step, N="count", camera="22", s="2*N", L="2*N, 6"):
    """Convert s and L of normalised image points to pixels, in place."""
    K = camera
    for n in range(N):
        x, y, row = get(w, s + 2 * n), get(w, s + 2 * n + 1), L + 12 * n
        u, v = pinhole_pixel(
            x, y, get(w, K), get(w, K + 1), get(w, K + 2), get(w, K + 4), get(w, K + 5)
        )
        put(w, s + 2 * n, u)
        put(w, s + 2 * n + 1, v)
        for c in range(6):
            below = get(w, row + 6 + c)
            put(w, row + c, get(w, K) * get(w, row + c) + get(w, K + 1) * below)
            put(w, row + 6 + c, get(w, K + 4) * below)
