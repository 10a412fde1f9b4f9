"""The pose of a target in the camera, fitted to the image of its marks."""

from typing import Any

import numpy as np

from robsim.kernels.estimation.pose_newton import newton_update
from robsim.kernels.formulas.interaction import put_point_rates
from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.formulas.perspective import LEAST_DEPTH
from robsim.kernels.linear_algebra.pseudoinverse import count_solution_rows, solve_block
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import absolute, any_lane, get, put, where
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.kernels.machine.stages import stage

MOST_UPDATES = 30  # at most, halved ones included
LEAST_IMAGE_MOTION = (
    4e-15  # an update that moves no image point by more is rounding: the run has arrived
)
ROUNDING = 1e-12  # of the sum of squares: an update that adds no more makes nothing worse
ROWS_PER_MARK, OTHER_ROWS = 36, 78  # rows to work in for each mark, and besides
SLOW_DECREASE = 0.5  # of the sum of squares: less is gained where what is left bends it, too
RCOND = 1e-12  # a motion that the image shows so little is left as it was guessed


@kernel
def reproject_marks(w, marks, N, T, x, weights, image):
    """Compute the image of marks at T: 2 N points, N inverse depths, 2 N weighted errors against x.

    They are NaN for marks behind the camera, and zero for those of weight 0.
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
            away = weight * (X * near - get(w, x + 2 * n + r))
            put(w, error + 2 * n + r, where(counts, away, 0.0))


@part
def _weighted_interaction(w, N, now, inverse, weights, L):
    """Compute L of the marks in the image, weighted."""
    for n in range(N):
        x, y = get(w, now + 2 * n), get(w, now + 2 * n + 1)
        put_point_rates(w, L + 12 * n, x, y, get(w, inverse + n))
        for i in range(12):
            put(w, L + 12 * n + i, get(w, weights + n) * get(w, L + 12 * n + i))


@part
def _largest_image_motion(w, L, V, rows):
    """Return max |L V| over all image coordinates; NaN where V is."""
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
    """Compute T = exp(share u), to 1e-5 of the angle at 1 rad and far better below.

    By Cayley's formula, with a = tan(theta/2) omega/theta: R = I + s ([a]x + [a]x^2) and
    t = s/2 k (v + a x v) + g (omega.v) omega, for s = 2 / (1 + |a|^2), and series of
    k = tan(theta/2) / (theta/2) and g = (1 - sin(theta)/theta) / theta^2.
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
    """Return the sum of the squares of the error, and by how much that of `ahead` is less."""
    square, gain = 0.0 * get(w, error), 0.0 * get(w, error)
    for i in range(rows):
        e, a = get(w, error + i), get(w, ahead + i)
        square, gain = square + e * e, gain + (e - a) * (e + a)
    return square, gain


@part
def _truncate_update(w, L, N, error, rcond, lost, back, other, scratch):
    """Let an update be L^+ e, without the motions that the image hardly shows, in lost runs."""
    solve_block(w, L, 2 * N, 6, error, -1, rcond, other, -4, scratch)
    _replace_rows(w, lost, other, back, 6)


@part
def _replace_rows(w, mask, new, rows, count):
    """Let rows be new ones where a mask is true."""
    for i in range(count):
        put(w, rows + i, where(mask, get(w, new + i), get(w, rows + i)))


def count_pose_fit_rows(N: int) -> int:
    """Return how many rows `fit_pose_stage` needs to work in, for N marks."""
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
    room="size",
    size="count",
):
    """Fit the pose T_c_o = T to the image x of N marks: (N, marks, x, guess, T, weights, room).

    The sum of squared distances between measured and reprojected points, all normalised and
    each times the weight of its mark, is made least: a virtual camera is servoed on its image
    (Comport, Marchand, Pressigout and Chaumette 2006), by the method of Gauss and Newton. With
    V = -L^+ (x(T) - x) the camera moves by exp(V), so T <- exp(-V) T. Where an update no longer
    halves the sum, Newton's method goes on (see `robsim.kernels.estimation.pose_newton`). An update
    that would make the image worse is halved. Each run stops on its own, and an exact guess is
    returned as it is. It is the minimum to which the guess leads: three marks, or marks in a
    plane, often have a second one. What 30 updates reach is returned, which is never worse than
    the guess. Needs three marks that are not on one line. NaN where a mark is not seen, or was
    guessed behind the camera, unless its weight is 0.
    """
    here, there, L, bend = room, room + 5 * N, room + 10 * N, room + 22 * N
    back = bend + 14 * N + 42
    step, updated, scratch = back + 6, back + 18, back + 36
    for i in range(12):
        put(w, T + i, get(w, guess + i))
    share = where(get(w, guess) > 0.0, 1.0, 1.0)
    moving, slow, rcond = share > 0.0, share < 0.0, RCOND * share
    reproject_marks(w, marks, N, T, x, weights, here)
    for _ in range(MOST_UPDATES):
        _weighted_interaction(w, N, here, here + 2 * N, weights, L)
        image = here, here + 2 * N, here + 3 * N
        lost = newton_update(w, N, image, weights, L, slow, moving, back, bend)
        if any_lane(lost):
            _truncate_update(w, L, N, here + 3 * N, rcond, lost, back, updated + 12, scratch)
        motion = _largest_image_motion(w, L, back, 2 * N)
        _cayley_exp(w, back, share, step)
        compose_lanes(w, step, T, updated)
        reproject_marks(w, marks, N, updated, x, weights, there)
        square, gain = _compare_squares(w, here + 3 * N, there + 3 * N, 2 * N)
        worse = ~(gain >= -ROUNDING * square)
        goes = moving & (
            motion > LEAST_IMAGE_MOTION
        )  # an update that is only rounding is not taken
        halved = goes & worse
        taken = moving & ~halved & (goes | ~(motion >= 0.0))  # also where it is NaN
        slow = slow | (gain < SLOW_DECREASE * square)
        _replace_rows(w, taken, updated, T, 12)
        _replace_rows(w, taken, there, here, 5 * N)
        twice = where(share < 0.5, 2.0 * share, 1.0)
        share = where(halved, 0.5 * share, where(taken, twice, share))
        moving = goes
        if not any_lane(goes):
            return


def fit_pose(marks: Any, x: Any, guess: Any, T: Any, weights: Any = None) -> None:
    """Fit the poses T[3, 4, b] to images x[n, 2, b] of marks[n, 3, b] from guesses, as `fit_pose_stage`."""
    N, runs, program = len(x), x.shape[2], Program()
    shapes = (N, 3), (N, 2), (3, 4), (N,)
    first, seen, guessed, weighed = (program.rows(*shape) for shape in shapes)
    found, room = program.rows(3, 4), program.rows(count_pose_fit_rows(N))
    program.add(
        fit_pose_stage, marks=first, x=seen, guess=guessed, T=found, weights=weighed, room=room
    )
    each = np.ones((N, runs)) if weights is None else weights
    given = np.concatenate([rows.reshape(-1, runs) for rows in (marks, x, guess, each)])
    T[:] = ProgramFunction(program, first, found, 12)(given).reshape(T.shape)
