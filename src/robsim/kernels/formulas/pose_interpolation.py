"""Straight motions of a frame with rotation about a fixed axis. The run is the last axis."""

from robsim.kernels.formulas.se3 import (
    compose,
    exp_se3,
    inverse_pose,
    rotation_to_quaternion,
    rotation_vector,
)
from robsim.kernels.machine.entry import entry


@entry(
    "float64[:, :, ::1], float64[:, :, ::1], out float64[:, :, ::1], out float64[:, :, ::1], "
    "out float64[:, ::1], out float64[:, ::1]"
)
def rotation_in_start_axes(A, B, back, turned, quaternion, turn):
    """Compute the rotation vector turn[3, b] of R_a' R_b, in axes of A[3, 4, b]."""
    inverse_pose(A, back)
    compose(back, B, turned)
    rotation_to_quaternion(turned, quaternion)
    rotation_vector(quaternion, turn)


@entry(
    "float64[:, :, ::1], float64[:, :, ::1], out float64[:, :, ::1], out float64[:, :, ::1], "
    "out float64[:, ::1], out float64[:, ::1]"
)
def rotation_in_base_axes(A, B, back, turned, quaternion, turn):
    """Compute the rotation vector turn[3, b] of R_b R_a', in the common base axes."""
    inverse_pose(A, back)
    compose(B, back, turned)
    rotation_to_quaternion(turned, quaternion)
    rotation_vector(quaternion, turn)


@entry(
    "float64[:, :, ::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, :, ::1], "
    "out float64[:, ::1], out float64[:, :, ::1], out float64[:, :, ::1]"
)
def interpolate_pose(T, translation, turn, share, end, twist, step, out):
    """Compute the pose out[3, 4, b] on the straight motion from T to end.

    share[2, b] are the shares of the translation way[3, b] and of the rotation vector turn[3, b] in
    axes of T. twist[6, b] and step[3, 4, b] are scratch arrays. If both shares are 1, out = end.
    """
    for i in range(3):
        for b in range(T.shape[2]):
            twist[i, b], twist[3 + i, b] = 0.0, share[1, b] * turn[i, b]
    exp_se3(twist, step)
    compose(T, step, out)
    for b in range(T.shape[2]):
        done = share[0, b] == 1.0 and share[1, b] == 1.0
        for i in range(3):
            out[i, 3, b] = T[i, 3, b] + share[0, b] * translation[i, b]
            if done:
                for c in range(4):
                    out[i, c, b] = end[i, c, b]
