"""Features of a pose and their interaction matrices, sdot = L V_c, for position-based servoing."""

import numpy as np

from robsim.kernels.features.point_features import points_3d_interaction
from robsim.kernels.formulas.lane_poses import compose_lanes, invert_lanes, pose_row
from robsim.kernels.formulas.lane_vectors import put_vector
from robsim.kernels.formulas.se3 import log_coefficient, log_quaternion, quaternion_of_rotation
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, get, put, sqrt, where
from robsim.kernels.machine.stages import stage


@part
def put_theta_u_rates(w, L, x, y, z):
    """Write L (3, 6) of the rotation vector theta u = (x, y, z) of R, for Rdot = R [omega]x.

    omega is the velocity of the camera. L = [0, I + [theta u]x / 2 + c [theta u]x^2] with
    c = (1 - (theta/2) cot(theta/2)) / theta^2. This is the inverse of the right Jacobian of SO(3)
    (Malis, Chaumette and Boudet 1999; Chaumette and Hutchinson 2006, the section on position-based
    servoing). The inverse rotation has the vector -theta u and L' = -(I - [theta u]x / 2 + c
    [theta u]x^2).
    """
    square = x * x + y * y + z * z
    c = log_coefficient(sqrt(square))
    xy, xz, yz = c * x * y, c * x * z, c * y * z
    _put_rotation_row(w, L, 1.0 + c * (x * x - square), xy - 0.5 * z, xz + 0.5 * y)
    _put_rotation_row(w, L + 6, xy + 0.5 * z, 1.0 + c * (y * y - square), yz - 0.5 * x)
    _put_rotation_row(w, L + 12, xz - 0.5 * y, yz + 0.5 * x, 1.0 + c * (z * z - square))


@part
def _put_rotation_row(w, row, x, y, z):
    """Write a row of L that depends on omega alone."""
    for i in range(3):
        put(w, row + i, 0.0)
    put_vector(w, row + 3, x, y, z)


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
    invert_lanes(w, scratch, T)


@stage
def theta_u_stage(w, step, T="3, 4", s="3", L="3, 6"):
    """Compute s and L of the rotation vector of a pose T."""
    a, b, c = pose_row(w, T, 0), pose_row(w, T, 1), pose_row(w, T, 2)
    x, y, z, u = quaternion_of_rotation(a, b, c)
    x, y, z = log_quaternion(x, y, z, u)
    put_vector(w, s, x, y, z)
    put_theta_u_rates(w, L, x, y, z)


@stage
def translation_stage(w, step, T="3, 4", in_goal="whole", s="3", L="3, 6"):
    """Compute s and L of the translation of a pose T.

    T is the pose of the camera in the goal camera if `in_goal`, with L = [R, 0]. Else it is the
    pose of the target in the camera, with L = [-I, [s]x]. Both are in Chaumette and Hutchinson
    2006, the section on position-based servoing.
    """
    for r in range(3):
        put(w, s + r, get(w, T + 4 * r + 3))
    if in_goal:
        for r in range(3):
            for c in range(3):
                put(w, L + 6 * r + c, get(w, T + 4 * r + c))
                put(w, L + 6 * r + 3 + c, 0.0)
    else:
        points_3d_interaction(vector(w, s, 3), matrix(w, L, 3, 6))
