"""The pose of a target in the camera, fitted to the image of its marks."""

import math

import numpy as np

from robsim.kernels.camera import NEAR
from robsim.kernels.features import points_interaction
from robsim.kernels.jit import kernel, part
from robsim.kernels.se3 import compose, exp
from robsim.kernels.solve import least_squares

UPDATES = 30  # at most, halved ones included
STILL = 4e-15  # an update that moves no image point by more is rounding: the run has arrived
ROUNDING = 1e-12  # of the sum of squares: an update that adds no more makes nothing worse
RCOND = 1e-12  # a motion that the image shows so little is left as it was guessed


@part
def _reproject(marks, T, x, now, Z, error):
    """Compute the image now[n, 2, b] of marks at T, depths Z[n, b] and error[2n, b] = now - x.

    They are NaN for marks behind the camera.
    """
    for n in range(marks.shape[0]):
        for b in range(T.shape[2]):
            px, py, pz = marks[n, 0, b], marks[n, 1, b], marks[n, 2, b]
            depth = T[2, 0, b] * px + T[2, 1, b] * py + T[2, 2, b] * pz + T[2, 3, b]
            Z[n, b] = depth if depth > NEAR else np.nan
        for r in range(2):
            for b in range(T.shape[2]):
                px, py, pz = marks[n, 0, b], marks[n, 1, b], marks[n, 2, b]
                X = T[r, 0, b] * px + T[r, 1, b] * py + T[r, 2, b] * pz + T[r, 3, b]
                now[n, r, b] = X / Z[n, b]
                error[2 * n + r, b] = now[n, r, b] - x[n, r, b]


@part
def _image_motion(L, V, motion):
    """Compute motion[b] = max |L V| over the 2n image coordinates; NaN where V is."""
    for b in range(motion.size):
        motion[b] = 0.0
    for i in range(L.shape[0]):
        for b in range(V.shape[1]):
            rate = 0.0
            for c in range(6):
                rate += L[i, c, b] * V[c, b]
            motion[b] = motion[b] if motion[b] >= abs(rate) else abs(rate)


@part
def _shorten(share, back):
    """Scale back[6, b] by share[b], in place."""
    for c in range(6):
        for b in range(share.size):
            back[c, b] *= share[b]


@part
def _compare(error, ahead, worse):
    """Compute worse[b]: whether the squares of ahead[2n, b] exceed those of error, or are NaN."""
    square, gain = np.zeros(worse.size), np.zeros(worse.size)
    for i in range(error.shape[0]):
        for b in range(worse.size):
            square[b] += error[i, b] * error[i, b]
            gain[b] += (error[i, b] - ahead[i, b]) * (error[i, b] + ahead[i, b])
    for b in range(worse.size):
        worse[b] = not gain[b] >= -ROUNDING * square[b]


@part
def _advance(updated, motion, worse, share, moving, T):
    """Update T in runs that move, except for those whose update is only rounding.

    An update that makes the image worse is not taken, but half of it next; the direction goes
    downhill. Returns how many go on; a run whose motion is NaN does not.
    """
    going = 0
    for b in range(motion.size):
        if moving[b]:
            moving[b] = motion[b] > STILL
            going += moving[b]
            if moving[b] and worse[b]:
                share[b] *= 0.5
            elif moving[b] or math.isnan(motion[b]):
                share[b] = min(1.0, 2.0 * share[b])
                _copy(updated, b, T)
    return going


@part
def _copy(A, b, out):
    """Copy run b of A to out."""
    for r in range(3):
        for c in range(4):
            out[r, c, b] = A[r, c, b]


@kernel
def fit_pose(marks, x, guess, T):
    """Fit the pose T_c_o = T[3, 4, b] to the image x[n, 2, b] of marks (N, 3), as `fit_poses`."""
    wide = np.empty((x.shape[0], 3, x.shape[2]))
    for n in range(x.shape[0]):
        for r in range(3):
            wide[n, r, :] = marks[n, r]
    fit_poses(wide, x, guess, T)


@kernel
def fit_poses(marks, x, guess, T):
    """Fit the pose T_c_o = T[3, 4, b] to the image x[n, 2, b] of marks[n, 3, b], from a guess.

    Gauss-Newton on the sum of squared distances between measured and reprojected points, all
    normalised: a virtual camera is servoed on its image (Comport, Marchand, Pressigout and
    Chaumette 2006). With V = -L^+ (x(T) - x) the camera moves by exp(V), so T <- exp(-V) T; an
    update that would make the image worse is halved. Each run stops on its own, and an exact guess
    is returned as it is. It is the minimum to which the guess leads: three marks, or marks in a
    plane, often have a second one. Where noise hides the tilt of a small target it is found slowly,
    and what 30 updates reach is returned, which is never worse than the guess. Needs three marks
    that are not on one line. NaN where a mark is not seen, or was guessed behind the camera.
    """
    N, runs = x.shape[0], x.shape[2]
    now, Z = np.empty((N, 2, runs)), np.empty((N, runs))
    error, ahead = np.empty((2 * N, runs)), np.empty((2 * N, runs))
    L, back, rank = np.empty((2 * N, 6, runs)), np.empty((6, runs)), np.empty(runs, np.int64)
    step, updated = np.empty((3, 4, runs)), np.empty((3, 4, runs))
    motion, share = np.empty(runs), np.ones(runs)
    moving, worse = np.ones(runs, np.bool_), np.empty(runs, np.bool_)
    for b in range(runs):
        _copy(guess, b, T)
    for _ in range(UPDATES):
        _reproject(marks, T, x, now, Z, error)
        points_interaction(now, Z, L)
        least_squares(L, error, 0.0, RCOND, back, rank)  # -V
        _image_motion(L, back, motion)
        _shorten(share, back)
        exp(back, step)
        compose(step, T, updated)
        _reproject(marks, updated, x, now, Z, ahead)
        _compare(error, ahead, worse)
        if _advance(updated, motion, worse, share, moving, T) == 0:
            return
