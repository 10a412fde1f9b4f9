"""Forward kinematics: stages that compute the poses of bodies, by kind of joint, and of frames.

A joint is `place . motion(x) . tail`. The tails are part of constants (see `robsim.robot.tree`), so
T = parent . place . motion(x). A pose has twelve rows, [R | t] row by row.
"""

import math

from robsim.kernels.formulas import plane_curves, se3
from robsim.kernels.formulas.lane_math import cos_sin, is_large_angle, near_cos_sin
from robsim.kernels.formulas.lane_poses import compose_lanes, pose_row, times_column
from robsim.kernels.machine.array_views import real_matrix, reals, wholes
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, align_stack, any_lane, get, put
from robsim.kernels.machine.stages import stage


@stage
def compose_frames(w, step, each="each: A=3, 4; B=3, 4; T=3, 4"):
    """Compute T = A B for each triple (A, B, T)."""
    for i in range(each[0]):
        compose_lanes(w, each[3 * i + 1], each[3 * i + 2], each[3 * i + 3])


@part
def _rotate_about_z(w, T, c, s):
    """Replace T by T Rz, with the cosine and sine of the angle of Rz."""
    for r in range(3):
        x, y = get(w, T + 4 * r), get(w, T + 4 * r + 1)
        put(w, T + 4 * r, c * x + s * y)
        put(w, T + 4 * r + 1, c * y - s * x)


@part
def _put_pair(w, row, pair):
    put(w, row, pair[0])
    put(w, row + 1, pair[1])


@stage
def place_revolute(w, step, each="each: parent=3, 4; place=3, 4; x=row; T=3, 4"):
    """Compute the poses T of bodies on revolute joints, about z.

    All cosines and sines are computed first and stored in T. They do not depend on the poses of
    parents, and the loop contains no library call.
    """
    align_stack()
    far = is_large_angle(get(w, each[3]))
    for i in range(each[0]):
        x = get(w, each[4 * i + 3])
        _put_pair(w, each[4 * i + 4], near_cos_sin(x))
        far = far | is_large_angle(x)
    if any_lane(far):
        for i in range(each[0]):
            _put_pair(w, each[4 * i + 4], cos_sin(get(w, each[4 * i + 3])))
    for i in range(each[0]):
        A, B, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 4]
        c, s = get(w, T), get(w, T + 1)
        for r in range(3):
            a = pose_row(w, A, r)
            X, Y = times_column(a, w, B, 0), times_column(a, w, B, 1)
            put(w, T + 4 * r, c * X + s * Y)
            put(w, T + 4 * r + 1, c * Y - s * X)
            put(w, T + 4 * r + 2, times_column(a, w, B, 2))
            put(w, T + 4 * r + 3, times_column(a, w, B, 3) + a[3])


@stage
def place_prismatic(w, step, each="each: parent=3, 4; place=3, 4; x=row; T=3, 4"):
    """Compute the poses T of bodies on prismatic joints, along z."""
    for i in range(each[0]):
        A, B, x, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 3], each[4 * i + 4]
        compose_lanes(w, A, B, T)
        for r in range(0, 12, 4):
            put(w, T + r + 3, get(w, T + r + 3) + get(w, T + r + 2) * get(w, x))


@stage
def place_floating(w, step, each="each: parent=3, 4; place=3, 4; x=row; T=3, 4"):
    """Compute the poses T of floating bodies: position and unit quaternion (x, y, z, w)."""
    for i in range(each[0]):
        A, B, q, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 3], each[4 * i + 4]
        compose_lanes(w, A, B, T)
        R = se3.quaternion_to_rotation(get(w, q + 3), get(w, q + 4), get(w, q + 5), get(w, q + 6))
        x, y, z = get(w, q), get(w, q + 1), get(w, q + 2)
        for r in range(3):
            a, b, c, t = pose_row(w, T, r)
            put(w, T + 4 * r + 3, t + (a * x + b * y + c * z))
            for j in range(3):
                put(w, T + 4 * r + j, a * R[0][j] + b * R[1][j] + c * R[2][j])


@stage
def place_planar(w, step, each="each: parent=3, 4; place=3, 4; x=row; T=3, 4"):
    """Compute the poses T of bodies that move in a plane, with coordinates x, y, theta."""
    for i in range(each[0]):
        A, B, q, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 3], each[4 * i + 4]
        compose_lanes(w, A, B, T)
        for r in range(3):
            a, b, _, t = pose_row(w, T, r)
            put(w, T + 4 * r + 3, t + (a * get(w, q) + b * get(w, q + 1)))
        c, s = cos_sin(get(w, q + 2))
        _rotate_about_z(w, T, c, s)


@kernel
def _load_curves(first, lengths, pieces, m, k):
    """Return m curves with k pieces in all from tables at addresses."""
    table = real_matrix(pieces, k, 7)
    return plane_curves.CurveTable(wholes(first, m + 1), reals(lengths, m), table)


@stage
def place_on_rail(
    w,
    step,
    first="table: m + 1",
    lengths="table: m",
    pieces="table: k, 7",
    m="count",
    k="count",
    curve="whole",
    parent="3, 4",
    place="3, 4",
    s="row",
    T="3, 4",
    curvature="row",
):
    """Compute the pose T of a body on a rail at arc length s, and the rail's curvature there.

    `curve` is the index of the rail among the curves.
    """
    curves = _load_curves(first, lengths, pieces, m, k)
    A, B, bend = parent, place, curvature
    compose_lanes(w, A, B, T)
    for i in range(WIDTH):
        x, y, c, d, w[bend * WIDTH + i] = plane_curves.curve_point(curves, curve, w[s * WIDTH + i])
        for r in range(0, 12, 4):
            at = (T + r) * WIDTH + i
            X, Y = w[at], w[at + WIDTH]
            w[at + 3 * WIDTH] += X * x + Y * y
            w[at], w[at + WIDTH] = c * X + d * Y, c * Y - d * X


@stage
def place_user_joint(w, step, each="each: parent=3, 4; place=3, 4; motion=3, 4; T=3, 4"):
    """Compute the poses T of bodies on user-defined joints. The rows `motion` hold motion(x)."""
    for i in range(each[0]):
        A, B, motion, T = each[4 * i + 1], each[4 * i + 2], each[4 * i + 3], each[4 * i + 4]
        compose_lanes(w, A, B, T)
        compose_lanes(w, T, motion, T)


@stage
def mimic_coordinate(w, step, source="row", x="row", ratio="row", source_ratio="row", numbers="3"):
    """Compute a dependent coordinate x = u source + v, with numbers (u, v).

    `ratio` is the derivative of x by the velocity that moves the independent coordinate, and
    `source_ratio` the same derivative of the source.
    """
    u = get(w, numbers)
    put(w, x, u * get(w, source) + get(w, numbers + 1))
    put(w, ratio, u * get(w, source_ratio))


@part
def _lane_triple(w, row, i):
    """Return three consecutive numbers of one lane."""
    at = row * WIDTH + i
    return w[at], w[at + WIDTH], w[at + 2 * WIDTH]


@kernel
def wheel_steering_angle(angle, wheelbase, x, y):
    """Return the angle of a car's wheel at (x, y), and its derivative by the steering angle a.

    The tangent of the wheel's angle is x sin(a)/(wheelbase cos(a) - y sin(a)), so all axles meet in
    one point (R. N. Jazar, Vehicle Dynamics, 2008, section 7.1).
    """
    c, s = math.cos(angle), math.sin(angle)
    near, far = wheelbase * c - y * s, x * s
    return math.atan2(far, near), x * wheelbase / (near * near + far * far)


@stage
def steer_wheel(w, step, source="row", x="row", ratio="row", source_ratio="row", numbers="3"):
    """Compute the angle x of a car's wheel from the steering angle `source`.

    The numbers are the wheelbase and the position (x, y) of the wheel. The ratios are described in
    `mimic_coordinate`.
    """
    number = numbers
    for i in range(WIDTH):
        base, X, Y = _lane_triple(w, number, i)
        w[x * WIDTH + i], slope = wheel_steering_angle(w[source * WIDTH + i], base, X, Y)
        w[ratio * WIDTH + i] = slope * w[source_ratio * WIDTH + i]


@stage
def evaluate_chord(
    w,
    step,
    first="table: m + 1",
    lengths="table: m",
    pieces="table: k, 7",
    m="count",
    k="count",
    source="row",
    x="row",
    ratio="row",
    source_ratio="row",
    numbers="3",
    curve="whole",
    quantity="whole",
):
    """Compute a coordinate x that a chord between two wheels on a rail determines.

    `source` is the arc length of the first wheel. `quantity` selects the quantity, as in
    `robsim.kernels.formulas.plane_curves.chord_quantity`. The numbers are the length of the chord,
    the radius of the wheels, and the position along the chord. The ratios are as in
    `mimic_coordinate`.
    """
    curves = _load_curves(first, lengths, pieces, m, k)
    number = numbers
    for i in range(WIDTH):
        length, radius, at = _lane_triple(w, number, i)
        s = w[source * WIDTH + i]
        w[x * WIDTH + i], slope = plane_curves.chord_quantity(
            curves, curve, s, length, radius, at, quantity
        )
        w[ratio * WIDTH + i] = slope * w[source_ratio * WIDTH + i]


@stage
def scale_curvature(w, step, curvature="row", slope="row"):
    """Multiply the curvature of a rail by the slope of its arc length, a dependent coordinate."""
    put(w, curvature, get(w, curvature) * get(w, slope))


@stage
def compute_wheel_ratios(w, step, steering="row or none", ratio="2", numbers="3"):
    """Compute the factors of v and omega of a vehicle in the angular speed of a wheel, in rad/s.

    The numbers are R, x, y. The hub at (x, y) moves at (v - omega y, omega x). A wheel of radius R
    with the steering angle h rolls at (cos(h) (v - omega y) + sin(h) omega x)/R.
    """
    number = numbers
    R, X, Y = get(w, number), get(w, number + 1), get(w, number + 2)
    c, s = 1.0 + 0.0 * X, 0.0 * X
    if steering >= 0:
        c, s = cos_sin(get(w, steering))
    put(w, ratio, c / R)
    put(w, ratio + 1, (s * X - c * Y) / R)
