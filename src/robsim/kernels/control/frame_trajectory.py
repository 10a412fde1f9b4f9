"""Stages that sample a straight motion of a frame, and compute its deviation and its twist.

Poses in the world have twelve rows, [R | t] row by row.
"""

from robsim.kernels.features.pose_features import put_theta_u_rates
from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.formulas.lane_vectors import put_vector
from robsim.kernels.formulas.pose_interpolation import (
    interpolate_pose,
    rotation_in_base_axes,
    rotation_in_start_axes,
)
from robsim.kernels.formulas.se3 import exp_se3
from robsim.kernels.formulas.speed_profiles import motion_share
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH, any_lane, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

PATH_SCRATCH = 46  # scratch rows of these stages


@kernel
def _vector_length(w, v):
    """Return the length of a vector in three rows."""
    x, y, z = get(w, v), get(w, v + 1), get(w, v + 2)
    return sqrt(x * x + y * y + z * z)


@stage
def plan_straight_motion(w, step, start="3, 4", goal="3, 4", scratch="46", displacement="8"):
    """Compute the translation and the rotation of a straight motion at step 0.

    The eight rows `displacement` are the translation, the rotation vector in axes of the start, and
    the lengths of both.
    """
    if step > 0:
        return
    for i in range(3):
        put(w, displacement + i, get(w, goal + 4 * i + 3) - get(w, start + 4 * i + 3))
    inverse, relative = matrix(w, scratch, 3, 4), matrix(w, scratch + 12, 3, 4)
    quaternion, turn = vector(w, scratch + 24, 4), vector(w, displacement + 3, 3)
    A, B = matrix(w, start, 3, 4), matrix(w, goal, 3, 4)
    rotation_in_start_axes(A, B, inverse, relative, quaternion, turn)
    put(w, displacement + 6, _vector_length(w, displacement))
    put(w, displacement + 7, _vector_length(w, displacement + 3))


@kernel
def _write_later_pose(w, step, dt, seconds, ramps, start, displacement, goal, scratch, out):
    """Write the pose of a straight motion at a step to the 12 rows from `out` + 12 on."""
    for i in range(2):
        for b in range(WIDTH):
            t, ramp = step * w[dt * WIDTH + b], w[(ramps + i) * WIDTH + b]
            w[(scratch + i) * WIDTH + b], _, _ = motion_share(t, w[seconds * WIDTH + b], ramp)
    T, end, later_pose = matrix(w, start, 3, 4), matrix(w, goal, 3, 4), matrix(w, out + 12, 3, 4)
    twist, motion_pose = vector(w, scratch + 2, 6), matrix(w, scratch + 8, 3, 4)
    motion = vector(w, displacement, 3), vector(w, displacement + 3, 3), vector(w, scratch, 2)
    interpolate_pose(T, *motion, end, twist, motion_pose, later_pose)


@stage
def sample_straight_motion(
    w,
    step,
    dt="row",
    seconds="row",
    ramps="2",
    start="3, 4",
    displacement="8",
    goal="3, 4",
    scratch="46",
    poses="2, 3, 4",
):
    """Compute two poses of a straight motion, now and one period later."""
    arguments = dt, seconds, ramps, start, displacement, goal, scratch, poses
    if step == 0:
        _write_later_pose(w, 0, *arguments)
    for i in range(12):
        put(w, poses + i, get(w, poses + 12 + i))
    _write_later_pose(w, step + 1, *arguments)


@stage
def compute_path_error(w, step, T="3, 4", end="3, 4", s="6", L="3, 6"):
    """Compute s, the position and the rotation vector from the end pose, and L of the rotation.

    In fixed axes d(theta u)/dt = L(-theta u) omega.
    """
    for i in range(3):
        put(w, s + i, get(w, T + 4 * i + 3))
    x, y, z = rotation_in_base_axes(w, end, T)
    put_vector(w, s + 3, x, y, z)
    put_theta_u_rates(w, L, -x, -y, -z)


@kernel
def _reduce_deviation(w, T, poses, ahead, left, scratch, target):
    """Compute `target`, the pose `ahead` displaced by the share `left` of the deviation of T."""
    deviation, correction, corrected = scratch + 28, scratch, scratch + 34
    x, y, z = rotation_in_base_axes(w, poses, T)
    put_vector(w, deviation, 0.0, 0.0, 0.0)
    put_vector(w, deviation + 3, left * x, left * y, left * z)
    exp_se3(vector(w, deviation, 6), matrix(w, correction, 3, 4))
    compose_lanes(w, correction, ahead, corrected)
    for i in range(3):
        offset = get(w, T + 4 * i + 3) - get(w, poses + 4 * i + 3)
        put(w, corrected + 4 * i + 3, get(w, ahead + 4 * i + 3) + left * offset)
    for i in range(12):
        put(w, target + i, where(left > 0.0, get(w, corrected + i), get(w, ahead + i)))


@stage
def compute_path_twist(
    w,
    step,
    T="3, 4",
    poses="2, 3, 4",
    gain="row",
    duration="row",
    scratch="46",
    target="3, 4",
    V="6",
):
    """Compute the twist V = (v, omega), in world axes, that moves a frame along its path.

    After one period the share 1 - gain dt of the deviation of T from its path remains, or zero if
    this share is negative.
    """
    ahead, dt = poses + 12, get(w, duration)
    rate = get(w, gain)
    left = 1.0 - where(rate < 1.0 / dt, rate, 1.0 / dt) * dt
    if any_lane(left > 0.0):
        _reduce_deviation(w, T, poses, ahead, left, scratch, target)
    else:
        for i in range(12):
            put(w, target + i, get(w, ahead + i))
    x, y, z = rotation_in_base_axes(w, T, target)
    put_vector(w, V + 3, x, y, z)
    for i in range(3):
        put(w, V + i, get(w, target + 4 * i + 3) - get(w, T + 4 * i + 3))
    for i in range(6):
        put(w, V + i, get(w, V + i) / dt)
