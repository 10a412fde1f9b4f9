"""Relative motions between views, for closed-form hand-eye calibration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, PoseLike, as_pose

FEWEST = 3  # views: the mount needs two motions
MOST_PAIRS = 5000  # of views
HALF_TURN = np.radians(170)  # a motion with a larger angle has an uncertain axis
LEAST_TURN = np.radians(0.2)  # smallest rms rotation about each of two axes


class RelativeMotions(NamedTuple):
    """Relative motions A and B between views i and j, which satisfy A X = X B for the mount X."""

    A: Pose  # (n, 4, 4), T_m_f,j T_m_f,i^-1 in axes of the frame m that carries the camera
    B: Pose  # (n, 4, 4), T_c_o,j T_c_o,i^-1 in axes of the camera


def find_relative_motions(T_m_f: Pose, T_c_o: Pose) -> RelativeMotions:
    """Return the motions between views, without motions near a half turn if enough others remain.

    InputError is raised if the motions do not rotate about two axes, so that the mount is
    undetermined.
    """
    i, j = _view_pairs(len(T_m_f.matrix))
    A, B = T_m_f[j] @ T_m_f[i].inv(), T_c_o[j] @ T_c_o[i].inv()
    axes = A.rotvec
    first, second = _rotation_spread(axes)
    if first < LEAST_TURN:
        raise InputError(
            "views: the arm hardly rotates between views; the mount needs rotations about two axes"
        )
    if second < LEAST_TURN:
        raise InputError(
            "views: the arm rotates about one axis only, so the mount along this axis is "
            "undetermined: rotate the arm about a second axis, too"
        )
    short = np.sqrt(np.square(axes).sum(-1)) < HALF_TURN
    used = short if _rotation_spread(axes[short])[1] >= LEAST_TURN else np.ones_like(short)
    return RelativeMotions(A[used], B[used])


def _rotation_spread(axes: Array) -> tuple[float, float]:
    """Return the rms of rotation vectors (n, 3) along their first two principal directions."""
    if len(axes) < 2:
        return 0.0, 0.0
    spread = np.linalg.svd(axes, compute_uv=False) / np.sqrt(len(axes))
    return float(spread[0]), float(spread[1])


def _view_pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices i < j of two views for each motion: all pairs, or only close pairs."""
    i, j = np.triu_indices(count, 1)
    if len(i) > MOST_PAIRS:
        near = j - i <= max(MOST_PAIRS // count, 1)
        i, j = i[near], j[near]
    return i, j


def check_view_poses(mount: PoseLike, camera: PoseLike) -> tuple[Pose, Pose]:
    """Return the poses T_m_f and T_c_o (V, 4, 4) of views; raise InputError for other shapes."""
    first, second = as_pose(mount), as_pose(camera)
    shapes = first.matrix.shape, second.matrix.shape
    if shapes[0] != shapes[1] or first.matrix.ndim != 3:
        raise InputError(
            "T_m_f and T_c_o: expected as many poses of the robot as of the target, (V, 4, 4), got "
            f"{shapes[0]} and {shapes[1]}"
        )
    if len(first.matrix) < FEWEST:
        raise InputError(f"poses: expected {FEWEST} views or more, got {len(first.matrix)}")
    return first, second


def cross_matrix(w: Array) -> Array:
    """Return [w]x (..., 3, 3) of vectors (..., 3), with [w]x p = w x p.

    >>> cross_matrix(np.array([1.0, 2, 3]))[0]
    array([ 0., -3.,  2.])
    """
    x, y, z = np.moveaxis(w, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def nearest_rotation(M: Array) -> Array:
    """Return the rotation R (3, 3) nearest to a matrix M, which maximises the trace of R' M.

    It follows from the singular value decomposition of M (Schoenemann 1966; Umeyama 1991 for the
    sign).

    >>> nearest_rotation(np.diag([2.0, 3.0, 0.5]))
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    U, _, Vt = np.linalg.svd(M)
    U[:, 2] *= np.linalg.det(U @ Vt)
    R: Array = U @ Vt
    return R


def build_pose(R: Array, t: Array) -> Pose:
    """Return the pose of a rotation (3, 3) and a position (3,)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return Pose(T)


def mean_pose(T: Pose) -> Pose:
    """Return the mean of poses (n, 4, 4): the rotation nearest to all, and the mean position.

    >>> mean_pose(Pose.at(0, 0, [1.0, 3.0], rpy=[[0, 0, 0.1], [0, 0, 0.3]]))
    <Pose position [0.0, 0.0, 2.0] rotvec [0.0, 0.0, 0.2]>
    """
    return build_pose(nearest_rotation(T.rotation.sum(axis=0)), T.position.mean(axis=0))
