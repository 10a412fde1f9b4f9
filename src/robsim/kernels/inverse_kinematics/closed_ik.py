"""Inverse kinematics in closed form: all solutions of suitable arms, one solution in each lane.

`robsim.robot.ik.closed_form` describes the arms and the angles.
All quantities are in axes that joint 1 carries: z along axis 1, y along axis 2. A point in the
plane of x and z is the complex number z + i x, so a rotation by t about y is the factor exp(i t).
"""

import math

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, absolute, floor, get, put, where
from robsim.kernels.machine.stages import perform_on_block, stage

GEOMETRY_TOLERANCE = 1e-9  # metres or radians: tolerance of the axes' geometry
ROUNDING = 1e-12  # tolerance of a sine or cosine above 1 for a fully stretched arm
TURN = 2.0 * math.pi
Y, Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# Rows of the geometry at q = 0. Joints 4 and higher do not move the point c.
# BASE: axes x, y, z that joint 1 carries, in base axes. ORIGIN: a point on axis 1 in the base.
# TOOL: point c, direction of the last axis, direction of the axis before it, in axes of the link.
# WRIST: directions of axes 4 and higher, two or three.
BASE, ORIGIN, TOOL, WRIST = 0, 9, 12, 21
# BARS: four bars as complex numbers, from axis 1 to 2, 2 to 3, and 3 to c; with five joints 3 to 4,
# and 4 to c. SIGNS: signs of the rotations about axes 3 and 4 relative to axis 2. ASIDE: c along y.
BARS, SIGNS, ASIDE = 30, 38, 40


@part
def _lane_vector(w, row, i):
    """Return three consecutive numbers of lane i."""
    at = row * WIDTH + i
    return w[at], w[at + WIDTH], w[at + 2 * WIDTH]


@part
def _planar_bar(w, axes, k, i):
    """Return bar k of lane i as a complex number."""
    at = (axes + BARS + 2 * k) * WIDTH + i
    return complex(w[at], w[at + WIDTH])


@part
def _to_plane(v):
    """Return the component of a vector in the plane of x and z as a complex number."""
    return complex(v[2], v[0])


@part
def _phase(z):
    """Return the phase of a complex number."""
    return math.atan2(z.imag, z.real)


@part
def _dot_vectors(a, b):
    """Return the dot product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def _cross_vectors(a, b):
    """Return the cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def _multiply_lane_matrix(w, A, stride, v, i):
    """Return A v. The rows of A have the stride `stride`."""
    a, b, c = (
        _lane_vector(w, A, i),
        _lane_vector(w, A + stride, i),
        _lane_vector(w, A + 2 * stride, i),
    )
    return _dot_vectors(a, v), _dot_vectors(b, v), _dot_vectors(c, v)


@kernel
def _rotate_about(axis, angle, v):
    """Return v rotated about an axis: v + sin a x v + (1 - cos) a x (a x v) (Rodrigues)."""
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    u = _cross_vectors(axis, v)
    w = _cross_vectors(axis, u)
    return v[0] + s * u[0] + c * w[0], v[1] + s * u[1] + c * w[1], v[2] + s * u[2] + c * w[2]


@part
def _angle_about(axis, start, end):
    """Return the angle about `axis` from `start` to `end`, for `start` perpendicular to `axis`."""
    return math.atan2(_dot_vectors(end, _cross_vectors(axis, start)), _dot_vectors(end, start))


@part
def _clip_cosine(x):
    """Return x clipped to [-1, 1], or NaN if |x| exceeds 1 by more than rounding."""
    return min(max(x, -1.0), 1.0) if abs(x) <= 1.0 + ROUNDING else math.nan


@kernel
def _base_angle(C, offset, fallback, shoulder):
    """Return the angle q1 that moves the plane of the arm, at distance `offset` from axis 1, to C.

    If C is on axis 1, every plane through the axis contains C. Then q1 moves the direction
    `fallback` into the plane. If `fallback` is zero or parallel to axis 1, q1 is 0 or half a turn.
    """
    radius, lean, turn = math.hypot(C[0], C[1]), 0.0, 0.0
    if radius > GEOMETRY_TOLERANCE or abs(offset) > GEOMETRY_TOLERANCE:
        lean, turn = math.asin(_clip_cosine(offset / radius)), math.atan2(C[1], C[0])
    elif math.hypot(fallback[0], fallback[1]) > GEOMETRY_TOLERANCE:
        turn = math.atan2(fallback[1], fallback[0])
    return turn - (math.pi - lean if shoulder else lean)


@kernel
def _two_bar_angles(along, u, w, elbow):
    """Return t2, t3 with exp(i t2) (u + exp(i t3) w) = along, by the law of cosines."""
    square = abs(along) ** 2 - abs(u) ** 2 - abs(w) ** 2
    bend = math.acos(_clip_cosine(square / (2.0 * abs(u) * abs(w))))
    t3 = _phase(u) - _phase(w) + (-bend if elbow else bend)
    return _phase(along) - _phase(u + complex(math.cos(t3), math.sin(t3)) * w), t3


@kernel
def _solve_base(w, axes, goal, shoulder, fallback, i):
    """Return q1, the complex vector from axis 2 to c, and the directions of the last two axes.

    The last three are in axes that joint 1 carries. If c is on axis 1 and `fallback` is 1, the last
    axis determines q1.
    """
    c, origin = (
        _multiply_lane_matrix(w, goal, 4, _lane_vector(w, axes + TOOL, i), i),
        _lane_vector(w, axes + ORIGIN, i),
    )
    first = (goal + 3) * WIDTH + i
    x, y, z = w[first], w[first + 4 * WIDTH], w[first + 8 * WIDTH]
    at = c[0] + x - origin[0], c[1] + y - origin[1], c[2] + z - origin[2]
    C = _multiply_lane_matrix(w, axes + BASE, 3, at, i)
    last = _multiply_lane_matrix(w, goal, 4, _lane_vector(w, axes + TOOL + 3, i), i)
    last = _multiply_lane_matrix(w, axes + BASE, 3, last, i)
    before = _multiply_lane_matrix(w, goal, 4, _lane_vector(w, axes + TOOL + 6, i), i)
    before = _multiply_lane_matrix(w, axes + BASE, 3, before, i)
    free = last[0] * fallback, last[1] * fallback, last[2] * fallback
    q1 = _base_angle(C, w[(axes + ASIDE) * WIDTH + i], free, shoulder)
    along = _to_plane(_rotate_about(Z, -q1, C)) - _planar_bar(w, axes, 0, i)
    return q1, along, _rotate_about(Z, -q1, last), _rotate_about(Z, -q1, before)


@stage
def solve_five_joints(w, step, axes="n", goal="3, 4", angles="each: row", n="count"):
    """Compute the angles of five joints, one branch of the solutions in each lane.

    The pitch of axis 5 determines axis 4, and the position of axis 4 the two bars.
    """
    for i in range(WIDTH):
        q1, along, last, before = _solve_base(w, axes, goal, i // 2 % 2, 1.0, i)
        h4, h5 = _lane_vector(w, axes + WRIST, i), _lane_vector(w, axes + WRIST + 3, i)
        sign3, sign4, _ = _lane_vector(w, axes + SIGNS, i)
        pitch = _phase(_to_plane(last)) - _phase(_to_plane(h5))
        end = complex(math.cos(pitch), math.sin(pitch)) * _planar_bar(w, axes, 3, i)
        t2, t3 = _two_bar_angles(
            along - end, _planar_bar(w, axes, 1, i), _planar_bar(w, axes, 2, i), i % 2
        )
        w[angles[1] * WIDTH + i], w[angles[2] * WIDTH + i] = q1, t2
        w[angles[3] * WIDTH + i], w[angles[4] * WIDTH + i] = sign3 * t3, sign4 * (pitch - t2 - t3)
        w[angles[5] * WIDTH + i] = _angle_about(h5, h4, _rotate_about(Y, -pitch, before))


@stage
def solve_six_joints(w, step, axes="n", goal="3, 4", angles="each: row", n="count"):
    """Compute the angles of six joints, one branch of the solutions in each lane.

    The wrist must rotate by M = E4 E5 E6. The angle from axis 4 to M h6 gives q5, the direction of
    M h6 about axis 4 gives q4, and the rotation of axis 5 by E6 gives q6.
    """
    for i in range(WIDTH):
        q1, along, last, before = _solve_base(w, axes, goal, i // 4 % 2, 0.0, i)
        h4, h5 = _lane_vector(w, axes + WRIST, i), _lane_vector(w, axes + WRIST + 3, i)
        h6, (sign3, _, _) = _lane_vector(w, axes + WRIST + 6, i), _lane_vector(w, axes + SIGNS, i)
        t2, t3 = _two_bar_angles(
            along, _planar_bar(w, axes, 1, i), _planar_bar(w, axes, 2, i), i // 2 % 2
        )
        aim, carried = _rotate_about(Y, -t2 - t3, last), _rotate_about(Y, -t2 - t3, before)
        side = _cross_vectors(h5, h4)
        up = _cross_vectors(h4, side)
        across, zero = (
            math.hypot(_dot_vectors(aim, side), _dot_vectors(aim, up)),
            _dot_vectors(h6, h4),
        )
        sign = -1.0 if i % 2 else 1.0
        q5 = math.atan2(sign * across, _dot_vectors(aim, h4)) - math.atan2(
            _dot_vectors(h6, side), zero
        )
        q4 = 0.0
        if across > ROUNDING:  # else axes 4 and 6 coincide, and only q4 + q6 is determined
            q4 = math.atan2(sign * _dot_vectors(aim, up), sign * _dot_vectors(aim, side))
        left = _rotate_about(h5, -q5, _rotate_about(h4, -q4, carried))
        w[angles[1] * WIDTH + i], w[angles[2] * WIDTH + i] = q1, t2
        w[angles[3] * WIDTH + i], w[angles[4] * WIDTH + i] = sign3 * t3, q4
        w[angles[5] * WIDTH + i], w[angles[6] * WIDTH + i] = q5, _angle_about(h6, h5, left)


@stage
def fold_angles(w, step, joints="each: x=row; limits=2"):
    """Shift angles by whole turns to (-pi, pi], or one turn further if only this angle is valid.

    An angle is valid within its limits.
    """
    for i in range(joints[0]):
        row, low, high = joints[1 + 2 * i], get(w, joints[2 + 2 * i]), get(w, joints[2 + 2 * i] + 1)
        x = get(w, row)
        x = x + TURN * floor(0.5 - x / TURN)
        up, down = (x < low) & (x + TURN <= high), (x > high) & (x - TURN >= low)
        put(w, row, where(up, x + TURN, where(down, x - TURN, x)))


@stage
def check_solution(
    w,
    step,
    T="3, 4",
    goal="3, 4",
    tolerance="row",
    q="n",
    n="count",
    bounds="n, 2",
    valid_out="row",
    within_out="row",
):
    """Compute `valid_out`, 1 if T equals the goal within the tolerance, and `within_out`.

    `within_out` is 1 if the solution is valid and all coordinates are within their bounds.
    """
    largest, zero = get(w, tolerance), 0.0 * get(w, tolerance)
    valid = zero >= 0.0
    for r in range(12):
        valid = valid & (absolute(get(w, T + r) - get(w, goal + r)) <= largest)
    within = valid
    for i in range(n):
        x, limits = get(w, q + i), bounds + 2 * i
        within = within & (get(w, limits) <= x) & (x <= get(w, limits + 1))
    put(w, valid_out, where(valid, 1.0, 0.0))
    put(w, within_out, where(within, 1.0, 0.0))


@entry(
    "int64[::1], int64[::1], int64[::1], float64[::1], float64, float64[:, :, ::1], "
    "out float64[:, :, ::1], out bool[:, ::1], out bool[:, ::1]"
)
def solve_closed_form(addresses, at, p, template, tolerance, goals, q, valid, within):
    """Compute all solutions q[run, solution, n] for goals[run, 4, 4] by stages.

    Invalid solutions are NaN. The first rows of the block are the tolerance, the flags `valid` and
    `within` of a solution, the goal, and the coordinates.
    """
    (runs, each), block = valid.shape, template.copy()
    put(block, 0, tolerance)
    for start in range(0, runs, WIDTH // each):
        for i in range(WIDTH):
            run = min(start + i // each, runs - 1)
            for r in range(3):
                for c in range(4):
                    block[(3 + 4 * r + c) * WIDTH + i] = goals[run, r, c]
        perform_on_block(addresses, at, p, block, 0)
        for i in range(min(WIDTH, (runs - start) * each)):
            run, k = start + i // each, i % each
            valid[run, k], within[run, k] = block[WIDTH + i] > 0.0, block[2 * WIDTH + i] > 0.0
            for j in range(q.shape[2]):
                q[run, k, j] = block[(15 + j) * WIDTH + i] if valid[run, k] else math.nan
