"""Robot-world/hand-eye calibration in closed form: X and Z from X B = A Z."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.calibration.relative_motions import (
    build_pose,
    check_view_poses,
    find_relative_motions,
    nearest_rotation,
)
from robsim.geometry.pose import Pose, PoseLike

TIE = 1e-6  # relative: closer singular values count as equal


def solve_robot_world(T_m_f: PoseLike, T_c_o: PoseLike) -> tuple[Pose, Pose]:
    """Return the mount X = T_m_c of a camera and the pose Z = T_f_o of its target.

    In every view X T_c_o = T_m_f Z. The method is Shah 2013 ("Solving the robot-world/hand-eye
    calibration problem using the Kronecker product"). Let K be the sum of R_c_o' (x) R_m_f' over
    the views. The singular vectors of the largest singular value of K are the rotations of X and Z;
    the positions follow by linear least squares.

    Parameters
    ----------
    T_m_f : pose_like of shape (V, 4, 4)
        Poses of the frame f that carries the target, in the frame m that carries the camera, from
        forward kinematics; see `solve_hand_eye`.
    T_c_o : pose_like of shape (V, 4, 4)
        Poses of the target in camera axes.

    Returns
    -------
    X, Z : Pose
        Pose of the camera in the frame m, and of the target in the frame f.

    Raises
    ------
    InputError
        If there are fewer than three views, or the robot rotates about one axis only.

    Examples
    --------
    >>> X, Z = Pose.at(0.1, 0, 0.05, rpy=(0, 0, 1)), Pose.at(1, 0, 0)
    >>> A = Pose.at(0, 0.1, [0.3, 0.4, 0.5], rpy=[[0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]])
    >>> solve_robot_world(A, X.inv() @ A @ Z)[1]
    <Pose position [1.0, 0.0, 0.0] rotvec [0.0, 0.0, 0.0]>
    """
    A, B = check_view_poses(T_m_f, T_c_o)
    find_relative_motions(A, B)  # raises InputError unless they rotate about two axes
    R_X, R_Z = _solve_rotations(A.rotation, B.rotation)
    equations = np.concatenate([np.broadcast_to(-np.eye(3), A.rotation.shape), A.rotation], axis=2)
    right = B.position @ R_X.T - A.position
    t = np.linalg.lstsq(equations.reshape(-1, 6), right.ravel(), rcond=None)[0]
    return build_pose(R_X, t[:3]), build_pose(R_Z, t[3:])


def _solve_rotations(R_A: Array, R_B: Array) -> tuple[Array, Array]:
    """Return R_X and R_Z of R_Z = R_A' R_X R_B, from vec(R_Z) = K vec(R_X), by columns."""
    K = np.einsum("vij,vkl->ikjl", R_B.swapaxes(1, 2), R_A.swapaxes(1, 2)).reshape(9, 9)
    U, s, Vt = np.linalg.svd(K)
    if s[1] > (1.0 - TIE) * s[0]:
        raise InputError("views: the arm rotates by half turns only, so the mount is undetermined")
    Z, X = U[:, 0].reshape(3, 3).T, Vt[0].reshape(3, 3).T
    sign = np.sign(np.linalg.det(X))
    return nearest_rotation(sign * X), nearest_rotation(sign * Z)


def solve_scaled_positions(R_X: Array, T_m_f: Pose, T_c_o: Pose) -> tuple[Array, Array, float]:
    """Return the positions (3,) of X and Z, and the factor s of the positions of the target.

    They solve R_X s t_c_o + t_X = R_m_f t_Z + t_m_f by linear least squares. Poses of a target that
    is s times as large as its marks have positions that are s times as far.
    """
    count = len(T_m_f.matrix)
    eye = np.broadcast_to(-np.eye(3), (count, 3, 3))
    seen = -(T_c_o.position @ R_X.T)[..., None]
    equations = np.concatenate([eye, T_m_f.rotation, seen], axis=2).reshape(-1, 7)
    t = np.linalg.lstsq(equations, -T_m_f.position.ravel(), rcond=None)[0]
    return t[:3], t[3:6], float(t[6])
