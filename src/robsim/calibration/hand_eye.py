"""Hand-eye calibration in closed form: the mount X of a camera from A X = X B."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.calibration.dual_quaternions import daniilidis
from robsim.calibration.relative_motions import (
    RelativeMotions,
    build_pose,
    check_view_poses,
    cross_matrix,
    find_relative_motions,
    nearest_rotation,
)
from robsim.geometry.pose import Pose, PoseLike

# diagonals of the identity and of the half turns about the axes
SWAPS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def tsai_lenz(motions: RelativeMotions) -> Pose:
    """Return the mount by the method of Tsai and Lenz 1989, rotation first.

    A motion with angle theta and axis n has P = 2 sin(theta/2) n, and the mount has p =
    tan(theta/2) n. They satisfy [P_A + P_B]x p = P_B - P_A. Because p is infinite at a half turn,
    the equations are also set up for a camera that is turned by half a turn about each of its axes,
    and the best conditioned equations are solved.
    """
    P_A = _half_sines(motions.A.rotvec)
    P_B = _half_sines(motions.B.rotvec)
    every = [_stack_cross_matrices(P_A + each * P_B) for each in SWAPS]
    swap = SWAPS[np.argmax([np.linalg.svd(M, compute_uv=False)[-1] for M in every])]
    p = np.linalg.lstsq(
        _stack_cross_matrices(P_A + swap * P_B), (swap * P_B - P_A).ravel(), rcond=None
    )[0]
    R = Pose.at(rotvec=_rotation_from_tangents(p)).rotation @ np.diag(swap)
    return build_pose(R, _solve_translation(motions, R))


def _stack_cross_matrices(P: Array) -> Array:
    """Return [P]x (3 n, 3) of vectors P (n, 3), one below the other."""
    return cross_matrix(P).reshape(-1, 3)


def _half_sines(w: Array) -> Array:
    """Return 2 sin(theta/2) n (n, 3) of rotation vectors theta n."""
    theta = np.sqrt(np.square(w).sum(-1, keepdims=True))
    return np.asarray(w * np.sinc(theta / (2 * np.pi)))


def _rotation_from_tangents(p: Array) -> Array:
    """Return the rotation vector theta n of p = tan(theta/2) n."""
    size = np.sqrt(p @ p)
    return np.asarray(p * (2 * np.arctan(size) / size if size > 0 else 2.0))


def park_martin(motions: RelativeMotions) -> Pose:
    """Return the mount by the method of Park and Martin 1994, rotation first.

    The rotation R minimises the sum of |R b - a|^2 over the rotation vectors a of A and b of B.
    """
    R = nearest_rotation(motions.A.rotvec.T @ motions.B.rotvec)
    return build_pose(R, _solve_translation(motions, R))


def _solve_translation(motions: RelativeMotions, R: Array) -> Array:
    """Return the position (3,) of the mount: (R_A - 1) t = R t_B - t_A, by least squares."""
    M = (motions.A.rotation - np.eye(3)).reshape(-1, 3)
    right = motions.B.position @ R.T - motions.A.position
    return np.asarray(np.linalg.lstsq(M, right.ravel(), rcond=None)[0])


METHODS: dict[str, Callable[[RelativeMotions], Pose]] = {
    "tsai_lenz": tsai_lenz,
    "park_martin": park_martin,
    "daniilidis": daniilidis,
}


def solve_hand_eye(T_m_f: PoseLike, T_c_o: PoseLike, method: str = "park_martin") -> Pose:
    """Return the mount X = T_m_c of a camera in closed form, from poses of several views.

    The poses of views i and j give the relative motions A = T_m_f,j T_m_f,i^-1 and B = T_c_o,j
    T_c_o,i^-1, which satisfy A X = X B. All methods are exact for exact poses; for noisy pixels
    `calibrate` is more accurate.

    Parameters
    ----------
    T_m_f : pose_like of shape (V, 4, 4)
        Poses of the frame f that carries the target, in the frame m that carries the camera, from
        forward kinematics. If the camera is on the hand and the target in the world, T_m_f is the
        inverse of the pose of the hand. If the camera is in the world and the target on the hand,
        it is the pose of the hand.
    T_c_o : pose_like of shape (V, 4, 4)
        Poses of the target in camera axes, for example from `estimate_pose`.
    method : {"park_martin", "tsai_lenz", "daniilidis"}, default "park_martin"
        Park and Martin 1994, Tsai and Lenz 1989, or Daniilidis 1999. The first two methods solve
        the rotation first; the last method solves rotation and translation together.

    Returns
    -------
    Pose
        Pose of the camera in the frame m.

    Raises
    ------
    InputError
        If there are fewer than three views, or the robot rotates about one axis only.

    Examples
    --------
    >>> X, Z = Pose.at(0.1, 0, 0.05, rpy=(0, 0, 1)), Pose.at(1, 0, 0)
    >>> A = Pose.at(0, 0.1, [0.3, 0.4, 0.5], rpy=[[0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]])
    >>> solve_hand_eye(A, X.inv() @ A @ Z)
    <Pose position [0.1, 0.0, 0.05] rotvec [0.0, 0.0, 1.0]>
    """
    if not is_known_name(method, METHODS):
        raise InputError(
            f"no method {format_value(method)}; {suggest_names(method, METHODS, 'methods')}"
        )
    return METHODS[method](find_relative_motions(*check_view_poses(T_m_f, T_c_o)))
