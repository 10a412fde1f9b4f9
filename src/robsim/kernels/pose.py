"""The pose of a target in the camera, fitted to the image of its marks."""

import numpy as np

from robsim.kernels.block import gather_rows, scatter_rows
from robsim.kernels.camera import NEAR
from robsim.kernels.features import put_point_rates
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import WIDTH, absolute, get, put, some, sqrt, where
from robsim.kernels.moving import screw
from robsim.kernels.placing import compose
from robsim.kernels.se3 import along_screw, quaternion_to_rotation
from robsim.kernels.solve import scratch_of, scratch_rows, solve_block

UPDATES = 30  # at most, halved ones included
STILL = 4e-15  # an update that moves no image point by more is rounding: the run has arrived
ROUNDING = 1e-12  # of the sum of squares: an update that adds no more makes nothing worse
EACH, OTHER = 19, 30  # rows to work in for each mark, and besides
RCOND = 1e-12  # a motion that the image shows so little is left as it was guessed


@part
def _reproject(w, marks, N, T, x, now, Z, error):
    """Compute the image `now` of marks at T, their depths Z, and the error now - x.

    They are NaN for marks behind the camera.
    """
    for n in range(N):
        px, py, pz = get(w, marks + 3 * n), get(w, marks + 3 * n + 1), get(w, marks + 3 * n + 2)
        depth = get(w, T + 8) * px + get(w, T + 9) * py + get(w, T + 10) * pz + get(w, T + 11)
        depth = where(depth > NEAR, depth, np.nan)
        put(w, Z + n, depth)
        for r in range(2):
            t = T + 4 * r
            X = get(w, t) * px + get(w, t + 1) * py + get(w, t + 2) * pz + get(w, t + 3)
            put(w, now + 2 * n + r, X / depth)
            put(w, error + 2 * n + r, X / depth - get(w, x + 2 * n + r))


@part
def _interaction(w, N, now, Z, L):
    """Compute L of the marks in the image."""
    for n in range(N):
        x, y = get(w, now + 2 * n), get(w, now + 2 * n + 1)
        put_point_rates(w, L + 12 * n, x, y, 1.0 / get(w, Z + n))


@part
def _image_motion(w, L, V, rows):
    """Return max |L V| over all image coordinates; NaN where V is."""
    most = 0.0 * get(w, V)
    for i in range(rows):
        rate = get(w, L + 6 * i) * get(w, V)
        for c in range(1, 6):
            rate = rate + get(w, L + 6 * i + c) * get(w, V + c)
        rate = absolute(rate)
        most = where(most >= rate, most, rate)
    return most


@part
def _exponential(w, V, share, T):
    """Compute T = exp(share V)."""
    vx, vy, vz = share * get(w, V), share * get(w, V + 1), share * get(w, V + 2)
    wx, wy, wz = share * get(w, V + 3), share * get(w, V + 4), share * get(w, V + 5)
    b, c, sinc, cosine = screw(sqrt(wx * wx + wy * wy + wz * wz))
    way, s = along_screw(vx, vy, vz, wx, wy, wz, b, c), 0.5 * sinc
    R = quaternion_to_rotation(s * wx, s * wy, s * wz, cosine)
    for r in range(3):
        for j in range(3):
            put(w, T + 4 * r + j, R[r][j])
        put(w, T + 4 * r + 3, way[r])


@part
def _is_worse(w, error, ahead, rows):
    """Return whether the squares of `ahead` exceed those of the error, or are NaN."""
    square, gain = 0.0 * get(w, error), 0.0 * get(w, error)
    for i in range(rows):
        e, a = get(w, error + i), get(w, ahead + i)
        square, gain = square + e * e, gain + (e - a) * (e + a)
    return ~(gain >= -ROUNDING * square)


def room_of(N: int) -> int:
    """Return how many rows `fit` needs to work in, for N marks."""
    return EACH * N + OTHER + scratch_of(2 * N, 6)


@kernel
def fit(w, marks, N, x, guess, T, room):
    """Fit the pose T_c_o = T to the image x of N marks, from a guess.

    Gauss-Newton on the sum of squared distances between measured and reprojected points, all
    normalised: a virtual camera is servoed on its image (Comport, Marchand, Pressigout and
    Chaumette 2006). With V = -L^+ (x(T) - x) the camera moves by exp(V), so T <- exp(-V) T; an
    update that would make the image worse is halved. Each run stops on its own, and an exact guess
    is returned as it is. It is the minimum to which the guess leads: three marks, or marks in a
    plane, often have a second one. Where noise hides the tilt of a small target it is found slowly,
    and what 30 updates reach is returned, which is never worse than the guess. Needs three marks
    that are not on one line. NaN where a mark is not seen, or was guessed behind the camera.
    """
    now, Z, error, ahead = room, room + 2 * N, room + 3 * N, room + 5 * N
    L, back = room + 7 * N, room + 19 * N
    step, updated, scratch = back + 6, back + 18, back + 30
    for i in range(12):
        put(w, T + i, get(w, guess + i))
    share = where(get(w, guess) > 0.0, 1.0, 1.0)
    moving, rcond = share > 0.0, RCOND * share
    for _ in range(UPDATES):
        _reproject(w, marks, N, T, x, now, Z, error)
        _interaction(w, N, now, Z, L)
        solve_block(w, L, 2 * N, 6, error, -1, rcond, back, scratch)  # -V
        motion = _image_motion(w, L, back, 2 * N)
        _exponential(w, back, share, step)
        compose(w, step, T, updated)
        _reproject(w, marks, N, updated, x, now, Z, ahead)
        worse = _is_worse(w, error, ahead, 2 * N)
        goes = moving & (motion > STILL)  # an update that is only rounding is not taken
        halved = goes & worse
        taken = moving & ~halved & (goes | ~(motion >= 0.0))  # also where it is NaN
        for i in range(12):
            put(w, T + i, where(taken, get(w, updated + i), get(w, T + i)))
        twice = where(share < 0.5, 2.0 * share, 1.0)
        share = where(halved, 0.5 * share, where(taken, twice, share))
        moving = goes
        if not some(goes):
            return


@kernel
def fit_pose(marks, x, guess, T):
    """Fit the poses T[3, 4, b] to images x[n, 2, b] of marks[n, 3, b] from guesses, as `fit`."""
    N, runs = x.shape[0], x.shape[2]
    points, start, found = 3 * N, 5 * N, 5 * N + 12
    room = found + 12
    block = np.zeros((room + EACH * N + OTHER + scratch_rows(2 * N, 6)) * WIDTH)
    for b in range(0, runs, WIDTH):
        for n in range(N):
            gather_rows(marks[n], b, 3 * n, block)
            gather_rows(x[n], b, points + 2 * n, block)
        for r in range(3):
            gather_rows(guess[r], b, start + 4 * r, block)
        fit(block, 0, N, points, start, found, room)
        for r in range(3):
            scatter_rows(block, found + 4 * r, b, T[r])
