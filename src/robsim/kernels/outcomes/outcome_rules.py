"""Stages that determine whether a run ends at an instant, and its outcome.

If several conditions hold, the first of this order is the outcome: a state that is not finite, a
joint limit, a mark behind the camera, a mark out of the image, a mark that is not detected at the
start, a picture with nothing in view or without a gradient, convergence, divergence, a command that
is not finite, a stall (a singularity if L J has lost rank, else a local minimum), the end of
the simulated time.
"""

import numpy as np

from robsim.kernels.formulas import perspective
from robsim.kernels.linear_algebra.svd import solve_truncated
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, sqrt, where
from robsim.kernels.machine.stages import stage
from robsim.kernels.outcomes.outcome_codes import (
    BEHIND_CAMERA,
    CONVERGED,
    DIVERGED,
    DIVERGENCE,
    JOINT_LIMIT,
    LOCAL_MINIMUM,
    NO_GRADIENT,
    NOT_FINITE,
    NOTHING_IN_VIEW,
    OUT_OF_IMAGE,
    RUNNING,
    SINGULAR,
    STALL,
    STALL_PERIODS,
    TIME_LIMIT,
    UNDETECTED,
)


@part
def _larger_magnitude(most, x):
    """Return the larger of `most` and |x|; NaN if either is NaN or |x| infinite."""
    size = absolute(x)
    return where(size > most, size, most) + size * 0.0


@part
def _largest_row_magnitude(w, x, n, zero):
    """Return the largest |x| of n rows; NaN if any x is NaN or infinite."""
    most = zero
    for i in range(n):
        most = _larger_magnitude(most, get(w, x + i))
    return most


@stage
def measure_error(w, step, k="count", errors="k", scale="k", size="row", norm="row"):
    """Compute the size and the norm of the error, in units of the first tolerance.

    The size is the largest |error| after multiplication by `scale`.
    """
    most = 0.0 * get(w, scale)
    square = most
    for i in range(k):
        error = get(w, errors + i) * get(w, scale + i)
        most, square = _larger_magnitude(most, error), square + error * error
    put(w, size, most)
    put(w, norm, sqrt(square))


@stage
def include_step(w, step, share="row", tolerance="row", size="row"):
    """Enlarge the size of the error to the share of a remaining step times the tolerance."""
    remaining = get(w, share) * get(w, tolerance)
    put(w, size, where(remaining > get(w, size), remaining, get(w, size)))


@stage
def count_still_periods(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    qd="n",
    scale="k",
    pace="row",
    tolerance="row",
    periods="row",
):
    """Count consecutive periods with a command that hardly moves the features.

    The motion of the features over the time 1/pace must be below the share STALL of the tolerance.
    Features are read until one has moved in each run of the block.
    """
    least = (STALL * get(w, tolerance)) * get(w, pace)
    most = 0.0 * get(w, scale)
    for i in range(k):
        change = 0.0 * get(w, scale)
        for j in range(n):
            change = change + (get(w, A + n * i + j) * get(w, scale + i)) * get(w, qd + j)
        most = _larger_magnitude(most, change)
        if not any_lane(most < least):
            break
    still = get(w, periods) if step > 0 else 0.0 * least
    put(w, periods, where(most < least, still + 1.0, 0.0))


@stage
def accumulate_path_length(w, step, T="3, 4", before="3", length="row"):
    """Add the motion of the origin of T since the last step to a path length."""
    x, y, z = get(w, T + 3), get(w, T + 7), get(w, T + 11)
    if step > 0:
        dx, dy, dz = x - get(w, before), y - get(w, before + 1), z - get(w, before + 2)
        put(w, length, get(w, length) + sqrt(dx * dx + dy * dy + dz * dz))
    put(w, before, x)
    put(w, before + 1, y)
    put(w, before + 2, z)


@part
def _store_divergence_bounds(w, norm, tolerance, hold, depth, N, bounds):
    """Store the bounds of the error and of the depth that mark divergence.

    The bound of the error is at least DIVERGENCE^2 tolerances. A run with `hold` may start at its
    goal and lag behind it later, so its error has no bound.
    """
    least = DIVERGENCE * tolerance
    scale = where(norm > least, norm, least)
    put(w, bounds, DIVERGENCE * where(hold, np.inf, scale))
    put(w, bounds + 1, DIVERGENCE * _largest_row_magnitude(w, depth, N, 0.0 * norm))


@stage
def judge_outcome(
    w,
    step,
    q="nq",
    nq="count",
    limits="2, nq",
    status="row",
    depth="N, 1",
    N="count",
    qd="n",
    n="count",
    size="row",
    norm="row",
    tolerance="row",
    hold="row",
    bounds="2",
    still_periods="row",
    steps="whole",
    outcome="row",
):
    """Compute the outcome of each run.

    The limits are nq lowest and nq highest coordinates. With `hold` a converged or stalled run
    continues until the last step. `still_periods` counts the periods without motion. The two rows
    `bounds` hold the error and the depth beyond which a run diverges.
    """
    size, norm, tolerance, hold = get(w, size), get(w, norm), get(w, tolerance), get(w, hold) > 0.0
    zero = 0.0 * tolerance
    if step == 0:
        _store_divergence_bounds(w, norm, tolerance, hold, depth, N, bounds)
    is_last, may_end = step == steps, ~hold
    if is_last:
        may_end = hold | ~hold
    code = zero + (TIME_LIMIT if is_last else RUNNING)
    code = where((get(w, still_periods) >= STALL_PERIODS) & may_end, 1.0 * LOCAL_MINIMUM, code)
    code = where(~(_largest_row_magnitude(w, qd, n, zero) < np.inf), 1.0 * NOT_FINITE, code)
    diverged = (norm > get(w, bounds)) | (
        _largest_row_magnitude(w, depth, N, zero) > get(w, bounds + 1)
    )
    code = where(diverged, 1.0 * DIVERGED, code)
    code = where((size < tolerance) & may_end, 1.0 * CONVERGED, code)
    code = where(~(size < np.inf), 1.0 * NOT_FINITE, code)
    code = where(get(w, status) == 1.0 * perspective.NO_GRADIENT, 1.0 * NO_GRADIENT, code)
    empty = get(w, status) == 1.0 * perspective.NOTHING_IN_VIEW
    code = where(empty, 1.0 * NOTHING_IN_VIEW, code)
    code = where(get(w, status) == 1.0 * perspective.UNDETECTED, 1.0 * UNDETECTED, code)
    code = where(get(w, status) == 1.0 * perspective.OUT_OF_IMAGE, 1.0 * OUT_OF_IMAGE, code)
    code = where(get(w, status) == 1.0 * perspective.BEHIND_CAMERA, 1.0 * BEHIND_CAMERA, code)
    for i in range(nq):
        x = get(w, q + i)
        code = where(
            (x < get(w, limits + i)) | (x > get(w, limits + nq + i)), 1.0 * JOINT_LIMIT, code
        )
    code = where(~(_largest_row_magnitude(w, q, nq, zero) < np.inf), 1.0 * NOT_FINITE, code)
    put(w, outcome, code)


@stage
def classify_stall(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    scale="k",
    rcond="row",
    full_rank="row",
    outcome="row",
    scratch="size",
    size="count",
):
    """Replace the outcome LOCAL_MINIMUM by SINGULAR if the scaled A = L J has lost rank.

    `full_rank` is the largest rank that A can have.
    """
    stalled = get(w, outcome) == 1.0 * LOCAL_MINIMUM
    if any_lane(stalled):
        scaled = scratch
        y = scaled + k * n
        for i in range(k):
            put(w, y + i, 0.0)
            for j in range(n):
                put(w, scaled + n * i + j, get(w, A + n * i + j) * get(w, scale + i))
        rank = solve_truncated(w, scaled, k, n, y, get(w, rcond), y + k, -1, y + k + n)
        singular = stalled & (rank < get(w, full_rank))
        put(w, outcome, where(singular, 1.0 * SINGULAR, get(w, outcome)))


@stage
def defer_convergence(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    qd="n",
    scale="k",
    pace="row",
    tolerance="row",
    size="row",
    age="row",
    periods="row",
    outcome="row",
    steps="whole",
    rates="each: row",
):
    """Continue a converged run if it only passes through its goal or moved after its image.

    A run converges only if its error was below the tolerance in every period since the image was
    taken (`age` periods), and if the difference between the joint velocities `rates` and the
    command qd moves no feature by the tolerance in the time 1/pace.
    """
    tolerance = get(w, tolerance)
    near = get(w, size) < tolerance
    if rates[0]:
        least = tolerance * get(w, pace)
        for i in range(k):
            change = 0.0 * tolerance
            for j in range(n):
                lag = get(w, rates[1 + j]) - get(w, qd + j)
                change = change + (get(w, A + n * i + j) * get(w, scale + i)) * lag
            near = near & (absolute(change) < least)
    before = get(w, periods) if step > 0 else 0.0 * tolerance
    count = where(near, before + 1.0, 0.0)
    put(w, periods, count)
    passing = (get(w, outcome) == 1.0 * CONVERGED) & (count <= get(w, age))
    put(
        w,
        outcome,
        where(passing, 1.0 * (TIME_LIMIT if step == steps else RUNNING), get(w, outcome)),
    )
