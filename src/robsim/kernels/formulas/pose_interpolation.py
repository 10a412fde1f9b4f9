"""Straight motions of a frame with rotation about a fixed axis. The run is the last axis."""

from robsim.kernels.formulas.lane_vectors import get_vector
from robsim.kernels.formulas.se3 import (
    compose,
    exp_se3,
    inverse_pose,
    log_quaternion,
    quaternion_of_rotation,
    rotation_to_quaternion,
    rotation_vector,
)
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part


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


@part
def rotation_in_base_axes(w, A, B):
    """Return the rotation vector of R_b R_a' on lanes, in the common base axes of two poses."""
    a, b, c = _rotate_back(w, B, A), _rotate_back(w, B + 4, A), _rotate_back(w, B + 8, A)
    x, y, z, u = quaternion_of_rotation(a, b, c)
    return log_quaternion(x, y, z, u)


@part
def _rotate_back(w, row, A):
    """Return a row vector times R_a'."""
    x, y, z = get_vector(w, row)
    a, b, c = get_vector(w, A), get_vector(w, A + 4), get_vector(w, A + 8)
    return (
        x * a[0] + y * a[1] + z * a[2],
        x * b[0] + y * b[1] + z * b[2],
        x * c[0] + y * c[1] + z * c[2],
    )


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
