"""Fit of a target's pose in the camera to the image of its marks."""

from typing import Any

import numpy as np

from robsim.kernels.estimation.pose_newton import newton_update
from robsim.kernels.formulas.interaction import put_point_rates
from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.formulas.perspective import LEAST_DEPTH
from robsim.kernels.linear_algebra.pseudoinverse import count_solution_rows, solve_block
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, where
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.kernels.machine.stages import stage

MOST_UPDATES = 30  # most updates, halved updates included
LEAST_IMAGE_MOTION = (
    4e-15  # a smaller image motion of all points is rounding: the fit has converged
)
ROUNDING = 1e-12  # of the sum of squares: a smaller increase is rounding
ROWS_PER_MARK, OTHER_ROWS = 36, 78  # scratch rows for each mark, and further scratch rows
SLOW_DECREASE = 0.5  # of the sum of squares: after a smaller decrease Newton's method takes over
RCOND = 1e-12  # motions with a smaller relative effect on the image keep their initial guess


@kernel
def reproject_marks(w, marks, N, T, x, weights, image):
    """Compute the image of N marks at the pose T, and its weighted errors from the points x.

    `image` has 2 N rows of points, N rows of inverse depths, and 2 N rows of errors. The rows are
    NaN for marks behind the camera. Errors of marks with weight 0 are zero.
    """
    now, inverse, error = image, image + 2 * N, image + 3 * N
    for n in range(N):
        px, py, pz = get(w, marks + 3 * n), get(w, marks + 3 * n + 1), get(w, marks + 3 * n + 2)
        depth = get(w, T + 8) * px + get(w, T + 9) * py + get(w, T + 10) * pz + get(w, T + 11)
        weight = get(w, weights + n)
        counts = weight > 0.0
        near = where(counts, 1.0 / where(depth > LEAST_DEPTH, depth, np.nan), 0.0)
        put(w, inverse + n, near)
        for r in range(2):
            t = T + 4 * r
            X = get(w, t) * px + get(w, t + 1) * py + get(w, t + 2) * pz + get(w, t + 3)
            put(w, now + 2 * n + r, X * near)
            residual = weight * (X * near - get(w, x + 2 * n + r))
            put(w, error + 2 * n + r, where(counts, residual, 0.0))


@part
def _weighted_interaction(w, N, now, inverse, weights, L):
    """Compute the interaction matrix L of the marks, with weighted rows."""
    for n in range(N):
        x, y, weight = get(w, now + 2 * n), get(w, now + 2 * n + 1), get(w, weights + n)
        put_point_rates(w, L + 12 * n, x, y, get(w, inverse + n))
        for i in range(12):
            put(w, L + 12 * n + i, weight * get(w, L + 12 * n + i))


@part
def _largest_image_motion(w, L, V, rows):
    """Return max |L V| over all image coordinates; NaN if V is NaN."""
    most = 0.0 * get(w, V)
    for i in range(rows):
        rate = get(w, L + 6 * i) * get(w, V)
        for c in range(1, 6):
            rate = rate + get(w, L + 6 * i + c) * get(w, V + c)
        rate = absolute(rate)
        most = where(most >= rate, most, rate)
    return most


@kernel
def _cayley_exp(w, u, share, T):
    """Compute T = exp(share u) by Cayley's formula.

    With a = tan(theta/2) omega/theta, R = I + s ([a]x + [a]x^2) and
    t = s/2 k (v + a x v) + g (omega.v) omega, where s = 2 / (1 + |a|^2). The functions
    k = tan(theta/2) / (theta/2) and g = (1 - sin(theta)/theta) / theta^2 are series. The relative
    error of the angle is 1e-5 at 1 rad and far smaller at small angles.
    """
    vx, vy, vz = share * get(w, u), share * get(w, u + 1), share * get(w, u + 2)
    ox, oy, oz = share * get(w, u + 3), share * get(w, u + 4), share * get(w, u + 5)
    q = 0.25 * (ox * ox + oy * oy + oz * oz)
    k = 1.0 + q * (1.0 / 3.0 + q * (2.0 / 15.0 + q * (17.0 / 315.0 + q * (62.0 / 2835.0))))
    x, y, z = 0.5 * k * ox, 0.5 * k * oy, 0.5 * k * oz
    s = 2.0 / (1.0 + (x * x + y * y + z * z))
    along = (ox * vx + oy * vy + oz * vz) * (1.0 / 6.0 - q * (1.0 / 30.0 - q * (1.0 / 315.0)))
    R = (
        (1.0 - s * (y * y + z * z), s * (x * y - z), s * (x * z + y)),
        (s * (x * y + z), 1.0 - s * (x * x + z * z), s * (y * z - x)),
        (s * (x * z - y), s * (y * z + x), 1.0 - s * (x * x + y * y)),
    )
    f = 0.5 * s * k
    t = (
        f * (vx + (y * vz - z * vy)) + along * ox,
        f * (vy + (z * vx - x * vz)) + along * oy,
        f * (vz + (x * vy - y * vx)) + along * oz,
    )
    for r in range(3):
        for j in range(3):
            put(w, T + 4 * r + j, R[r][j])
        put(w, T + 4 * r + 3, t[r])


@part
def _compare_squares(w, error, ahead, rows):
    """Return the sum of squares of the error, and its decrease from `error` to `ahead`."""
    square, gain = 0.0 * get(w, error), 0.0 * get(w, error)
    for i in range(rows):
        e, a = get(w, error + i), get(w, ahead + i)
        square, gain = square + e * e, gain + (e - a) * (e + a)
    return square, gain


@part
def _truncate_update(w, L, N, error, rcond, lost, back, other, scratch):
    """Replace the update by the truncated L^+ e in lost runs."""
    solve_block(w, L, 2 * N, 6, error, -1, rcond, other, -4, scratch)
    _replace_rows(w, lost, other, back, 6)


@part
def _replace_rows(w, mask, new, rows, count):
    """Replace rows by new rows in the runs of a mask."""
    for i in range(count):
        put(w, rows + i, where(mask, get(w, new + i), get(w, rows + i)))


def count_pose_fit_rows(N: int) -> int:
    """Return the number of scratch rows that `fit_pose_stage` needs for N marks."""
    return ROWS_PER_MARK * N + OTHER_ROWS + count_solution_rows(2 * N, 6)


@stage
def fit_pose_stage(
    w,
    step,
    N="count",
    marks="N, 3",
    x="N, 2",
    guess="3, 4",
    T="3, 4",
    weights="N",
    scratch="size",
    size="count",
):
    """Fit the pose T = T_c_o to the normalised image points x of N marks, from a guess.

    The fit minimises the sum of squared distances between measured and reprojected points, each
    multiplied by the weight of its mark. It servoes a virtual camera on its image (Comport,
    Marchand, Pressigout and Chaumette 2006) by the Gauss-Newton method. With V = -L^+ (x(T) - x)
    the camera moves by exp(V), so T <- exp(-V) T. If an update does not halve the sum of squares,
    Newton's method follows (see `robsim.kernels.estimation.pose_newton`). An update that increases
    the sum is halved. Each run stops independently of the other runs, and an exact guess is
    returned unchanged.

    The result is the local minimum near the guess; three marks, or marks in a plane, often have a
    second minimum. After 30 updates the last pose is returned, and it is never worse than the
    guess. The fit needs three marks that are not collinear. The result is NaN if a mark of nonzero
    weight is not measured, or is behind the camera at the guess.
    """
    image_rows, next_image, L, bend = scratch, scratch + 5 * N, scratch + 10 * N, scratch + 22 * N
    update = bend + 14 * N + 42
    step, updated, svd_rows = update + 6, update + 18, update + 36
    for i in range(12):
        put(w, T + i, get(w, guess + i))
    share = where(get(w, guess) > 0.0, 1.0, 1.0)
    moving, slow, rcond = share > 0.0, share < 0.0, RCOND * share
    reproject_marks(w, marks, N, T, x, weights, image_rows)
    for _ in range(MOST_UPDATES):
        _weighted_interaction(w, N, image_rows, image_rows + 2 * N, weights, L)
        image = image_rows, image_rows + 2 * N, image_rows + 3 * N
        singular = newton_update(w, N, image, weights, L, slow, moving, update, bend)
        if any_lane(singular):
            _truncate_update(
                w, L, N, image_rows + 3 * N, rcond, singular, update, updated + 12, svd_rows
            )
        motion = _largest_image_motion(w, L, update, 2 * N)
        _cayley_exp(w, update, share, step)
        compose_lanes(w, step, T, updated)
        reproject_marks(w, marks, N, updated, x, weights, next_image)
        square, gain = _compare_squares(w, image_rows + 3 * N, next_image + 3 * N, 2 * N)
        increases = ~(gain >= -ROUNDING * square)
        # an update within rounding is not accepted
        proceeds = moving & (motion > LEAST_IMAGE_MOTION)
        halved = proceeds & increases
        accepted = moving & ~halved & (proceeds | ~(motion >= 0.0))  # a NaN is accepted, too
        slow = slow | (gain < SLOW_DECREASE * square)
        _replace_rows(w, accepted, updated, T, 12)
        _replace_rows(w, accepted, next_image, image_rows, 5 * N)
        doubled = where(share < 0.5, 2.0 * share, 1.0)
        share = where(halved, 0.5 * share, where(accepted, doubled, share))
        moving = proceeds
        if not any_lane(proceeds):
            return


def fit_pose(marks: Any, x: Any, guess: Any, T: Any, weights: Any = None) -> None:
    """Fit the poses T[3, 4, b] to images x[n, 2, b] of marks[n, 3, b], from guesses.

    See `fit_pose_stage` for the method.
    """
    N, runs, program = len(x), x.shape[2], Program()
    shapes = (N, 3), (N, 2), (3, 4), (N,)
    first, points, start, factors = (program.rows(*shape) for shape in shapes)
    pose, room = program.rows(3, 4), program.rows(count_pose_fit_rows(N))
    program.add(
        fit_pose_stage, marks=first, x=points, guess=start, T=pose, weights=factors, scratch=room
    )
    each = np.ones((N, runs)) if weights is None else weights
    arrays = np.concatenate([rows.reshape(-1, runs) for rows in (marks, x, guess, each)])
    T[:] = ProgramFunction(program, first, pose, 12)(arrays).reshape(T.shape)
