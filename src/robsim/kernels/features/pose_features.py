"""Features of a pose and their interaction matrices, sdot = L V_c, for position-based servoing."""

import math

import numpy as np

from robsim.kernels.features.point_features import points_3d_interaction
from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.formulas.se3 import (
    inverse_pose,
    log_coefficient,
    rotation_to_quaternion,
    rotation_vector,
)
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stages import stage


@part
def theta_u_interaction(w, L):
    """Compute L[3, 6, b] of w[3, b] = theta u of R, for Rdot = R [omega]x of the camera.

    L = [0, I + [w]x / 2 + c [w]x^2] with c = (1 - (theta/2) cot(theta/2)) / theta^2. This is the
    inverse of the right Jacobian of SO(3) (Malis, Chaumette and Boudet 1999; Chaumette and
    Hutchinson 2006, the section on position-based servoing). The inverse rotation w' = -w has
    L' = -(I - [w']x / 2 + c [w']x^2).
    """
    for b in range(w.shape[1]):
        x, y, z = w[0, b], w[1, b], w[2, b]
        square = x * x + y * y + z * z
        c = log_coefficient(math.sqrt(square))
        for r in range(3):
            L[r, 0, b], L[r, 1, b], L[r, 2, b] = 0.0, 0.0, 0.0
        L[0, 3, b], L[1, 4, b], L[2, 5, b] = (
            1.0 + c * (x * x - square),
            1.0 + c * (y * y - square),
            1.0 + c * (z * z - square),
        )
        L[0, 4, b], L[1, 3, b] = c * x * y - 0.5 * z, c * x * y + 0.5 * z
        L[0, 5, b], L[2, 3, b] = c * x * z + 0.5 * y, c * x * z - 0.5 * y
        L[1, 5, b], L[2, 4, b] = c * y * z - 0.5 * x, c * y * z + 0.5 * x


@part
def camera_origin_interaction(T, L):
    """Compute L[3, 6, b] = [R, 0] of the camera's origin, from its pose T[3, 4, b].

    Chaumette and Hutchinson 2006, the section on position-based servoing.
    """
    for r in range(3):
        for c in range(3):
            for b in range(T.shape[2]):
                L[r, c, b], L[r, 3 + c, b] = T[r, c, b], 0.0


@stage
def flag_lost_pose(w, step, N="count", points="N, 2", T="3, 4", lost="row"):
    """Set `lost` to 1 if the pose is NaN although all marks are measured.

    Then the guess of the pose was behind the camera. `lost` stays 1 until another stage resets it.
    """
    size = absolute(get(w, points))
    for i in range(1, 2 * N):
        size = size + absolute(get(w, points + i))
    is_lost = (size < np.inf) & ~(absolute(get(w, T)) < np.inf)
    put(w, lost, where(is_lost, 1.0, get(w, lost)))


@stage
def goal_camera_pose_stage(w, step, T_c_o="3, 4", T_o_goal="3, 4", scratch="3, 4", T="3, 4"):
    """Compute T, the pose of the camera in the goal camera, from T_c_o and the goal's T_o_goal."""
    compose_lanes(w, T_c_o, T_o_goal, scratch)
    inverse_pose(matrix(w, scratch, 3, 4), matrix(w, T, 3, 4))


@stage
def theta_u_stage(w, step, T="3, 4", scratch="4", s="3", L="3, 6"):
    """Compute s and L of the rotation vector of a pose T."""
    quaternion, s = vector(w, scratch, 4), vector(w, s, 3)
    rotation_to_quaternion(matrix(w, T, 3, 4), quaternion)
    rotation_vector(quaternion, s)
    theta_u_interaction(s, matrix(w, L, 3, 6))


@stage
def translation_stage(w, step, T="3, 4", in_goal="whole", s="3", L="3, 6"):
    """Compute s and L of the translation of a pose T.

    T is the pose of the camera in the goal camera if `in_goal`, else the pose of the target in the
    camera.
    """
    for r in range(3):
        put(w, s + r, get(w, T + 4 * r + 3))
    if in_goal:
        camera_origin_interaction(matrix(w, T, 3, 4), matrix(w, L, 3, 6))
    else:
        points_3d_interaction(vector(w, s, 3), matrix(w, L, 3, 6))
