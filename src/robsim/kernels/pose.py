"""The pose of a target in the camera, fitted to the image of its marks."""

import math

import numpy as np

from robsim.kernels.camera import NEAR
from robsim.kernels.features import points_interaction
from robsim.kernels.jit import kernel, part
from robsim.kernels.se3 import compose, exp
from robsim.kernels.solve import least_squares

UPDATES = 30  # at most
STILL = 4e-15  # an update that moves no image point by more is rounding: the run has arrived
ARRIVED = 1e-9  # an update may move the image so much after the last of them, as slow runs do
RCOND = 1e-12  # a motion that the image shows so little is left as it was guessed


@part
def _reproject(marks, T, x, now, Z, error):
    """now[n, 2, b]: the image of marks at T, Z[n, b]: depth, error[2n, b]: now - x; NaN behind."""
    for n in range(marks.shape[0]):
        px, py, pz = marks[n, 0], marks[n, 1], marks[n, 2]
        for b in range(T.shape[2]):
            depth = T[2, 0, b] * px + T[2, 1, b] * py + T[2, 2, b] * pz + T[2, 3, b]
            Z[n, b] = depth if depth > NEAR else np.nan
        for r in range(2):
            for b in range(T.shape[2]):
                X = T[r, 0, b] * px + T[r, 1, b] * py + T[r, 2, b] * pz + T[r, 3, b]
                now[n, r, b] = X / Z[n, b]
                error[2 * n + r, b] = now[n, r, b] - x[n, r, b]


@part
def _image_motion(L, V, motion):
    """motion[b] = max |L V|, the largest of the 2n image coordinates' motions; NaN where V is."""
    for b in range(motion.size):
        motion[b] = 0.0
    for i in range(L.shape[0]):
        for b in range(V.shape[1]):
            rate = 0.0
            for c in range(6):
                rate += L[i, c, b] * V[c, b]
            motion[b] = motion[b] if motion[b] >= abs(rate) else abs(rate)


@part
def _advance(updated, motion, moving, T):
    """T <- updated in runs that move, but for those whose update is rounding: these are left.

    Returns how many go on; a run whose motion is NaN does not.
    """
    going = 0
    for b in range(motion.size):
        if moving[b]:
            moving[b] = motion[b] > STILL
            going += moving[b]
            if moving[b] or math.isnan(motion[b]):
                _copy(updated, b, T)
    return going


@part
def _copy(A, b, out):
    """Out of run b = A of run b."""
    for r in range(3):
        for c in range(4):
            out[r, c, b] = A[r, c, b]


@part
def _give_up(motion, moving, T):
    """NaN where the last update still moved the image."""
    for b in range(motion.size):
        if moving[b] and not motion[b] < ARRIVED:
            for r in range(3):
                for c in range(4):
                    T[r, c, b] = np.nan


@kernel
def fit_pose(marks, x, guess, T):
    """T[3, 4, b] = T_c_o: the pose that puts marks (N, 3) at x[n, 2, b], from guess[3, 4, b].

    Gauss-Newton on the sum of squared distances between measured and reprojected points, all
    normalised: a virtual camera is servoed on its image (Comport, Marchand, Pressigout and
    Chaumette 2006). With V = -L^+ (x(T) - x) the camera moves by exp(V), so T <- exp(-V) T. Each
    run stops on its own, and an exact guess is returned as it is. It is the minimum to which the
    guess leads: three marks, or marks in a plane, often have a second one. Needs three marks that
    are not on one line. NaN where it does not converge, or a mark gets behind the camera.
    """
    N, runs = x.shape[0], x.shape[2]
    now, Z, error = np.empty((N, 2, runs)), np.empty((N, runs)), np.empty((2 * N, runs))
    L, back, rank = np.empty((2 * N, 6, runs)), np.empty((6, runs)), np.empty(runs, np.int64)
    step, updated = np.empty((3, 4, runs)), np.empty((3, 4, runs))
    motion, moving = np.empty(runs), np.ones(runs, np.bool_)
    for b in range(runs):
        _copy(guess, b, T)
    for _ in range(UPDATES):
        _reproject(marks, T, x, now, Z, error)
        points_interaction(now, Z, L)
        least_squares(L, error, 0.0, RCOND, back, rank)  # -V
        _image_motion(L, back, motion)
        exp(back, step)
        compose(step, T, updated)
        if _advance(updated, motion, moving, T) == 0:
            return
    _give_up(motion, moving, T)
