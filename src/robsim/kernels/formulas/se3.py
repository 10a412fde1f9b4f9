"""Rotations and rigid motions: composition, exponential, quaternions (x, y, z, w).

The formulas need no special case for tiny angles. They use half-angle forms, a series that is
accurate to 1 rad (see `exp_coefficients`), and a continued fraction (see `log_coefficient`). They
are checked against 60-digit numbers for angles from 1e-12 to pi.
"""

import math

from robsim.kernels.formulas.lane_math import arc_tangent
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import copy_sign, sqrt, where


@part
def sinc(x):
    """Return sin(x)/x, and 1 for x = 0."""
    return math.sin(x) / x if x != 0.0 else 1.0


@part
def cubic_coefficient(theta):
    """Return (t - sin t)/t^3 for t <= 1 with an error of 2e-16.

    The series is 1/6 (1 - t2/(4 5) (1 - t2/(6 7) (1 - ...))) with t2 = t^2.
    """
    square = theta * theta
    nested = 1.0 + 0.0 * theta
    for n in range(10, 0, -1):
        nested = 1.0 - square * nested / ((2 * n + 2) * (2 * n + 3))
    return nested / 6.0


@part
def exp_coefficients(theta):
    """Return the coefficients of exp for t >= 0.

    They are a = sin(t)/t, b = (1 - cos t)/t^2 and c = (t - sin t)/t^3.
    """
    half = sinc(0.5 * theta)
    c = (theta - math.sin(theta)) / theta**3 if theta > 1.0 else cubic_coefficient(theta)
    return sinc(theta), 0.5 * half * half, c


@entry("float64 -> float64", inline="always")
def log_coefficient(theta):
    """Return (1 - h cot h) / theta^2 with h = theta/2, for 0 <= theta <= pi.

    It is 1/12 at 0 and 1/pi^2 at pi. Lambert's continued fraction is
    h cot h = 1 - h2/(3 - h2/(5 - h2/(7 - ...))) with h2 = h^2. It has no cancellation and is
    accurate for every angle.
    """
    tail = 25.0 + 0.0 * theta
    for odd in range(23, 1, -2):
        tail = odd - 0.25 * theta * theta / tail
    return 0.25 / tail


@entry("float64[:, :, ::1], float64[:, :, ::1], out float64[:, :, ::1]")
def compose(A, B, out):
    """Compute out = A B for poses A[3, 4, b] and B[3, 4, b]."""
    for r in range(3):
        for c in range(4):
            shift = 1.0 if c == 3 else 0.0
            for b in range(A.shape[2]):
                out[r, c, b] = (
                    A[r, 0, b] * B[0, c, b] + A[r, 1, b] * B[1, c, b] + A[r, 2, b] * B[2, c, b]
                ) + shift * A[r, 3, b]


@entry("float64[:, :, ::1], out float64[:, :, ::1]", inline="always")
def inverse_pose(A, out):
    """Compute out = A^-1 = [R' | -R' t] for poses A[3, 4, b]."""
    for r in range(3):
        for b in range(A.shape[2]):
            out[r, 0, b], out[r, 1, b], out[r, 2, b] = A[0, r, b], A[1, r, b], A[2, r, b]
            out[r, 3, b] = -(
                A[0, r, b] * A[0, 3, b] + A[1, r, b] * A[1, 3, b] + A[2, r, b] * A[2, 3, b]
            )


@part
def quaternion_to_rotation(x, y, z, w):
    """Return the three rows of R for a unit quaternion."""
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


@entry("float64[:, ::1], out float64[:, :, ::1]")
def pose_from_quaternion(q, T):
    """Compute T[3, 4, b] for q[7, b], a position and a unit quaternion (x, y, z, w)."""
    for b in range(q.shape[1]):
        rows = quaternion_to_rotation(q[3, b], q[4, b], q[5, b], q[6, b])
        for r in range(3):
            T[r, 0, b], T[r, 1, b], T[r, 2, b] = rows[r]
            T[r, 3, b] = q[r, b]


@part
def exp_quaternion(wx, wy, wz):
    """Return the unit quaternion of the rotation vector w."""
    theta = math.sqrt(wx * wx + wy * wy + wz * wz)
    s = 0.5 * sinc(0.5 * theta)
    return s * wx, s * wy, s * wz, math.cos(0.5 * theta)


@part
def quaternion_product(ax, ay, az, aw, bx, by, bz, bw):
    """Return the Hamilton product a b."""
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


@part
def exp_translation(vx, vy, vz, wx, wy, wz):
    """Return the translation of the pose exp(v, w)."""
    _, b, c = exp_coefficients(math.sqrt(wx * wx + wy * wy + wz * wz))
    return along_screw(vx, vy, vz, wx, wy, wz, b, c)


@part
def along_screw(vx, vy, vz, wx, wy, wz, b, c):
    """Return v + b (w x v) + c w x (w x v)."""
    ux, uy, uz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
    return (
        vx + b * ux + c * (wy * uz - wz * uy),
        vy + b * uy + c * (wz * ux - wx * uz),
        vz + b * uz + c * (wx * uy - wy * ux),
    )


@entry("float64[:, ::1], out float64[:, :, ::1]")
def exp_se3(twist, T):
    """Compute T[3, 4, b] = exp of twist[6, b] = (v, omega)."""
    for b in range(twist.shape[1]):
        wx, wy, wz = twist[3, b], twist[4, b], twist[5, b]
        x, y, z, w = exp_quaternion(wx, wy, wz)
        rows = quaternion_to_rotation(x, y, z, w)
        p = exp_translation(twist[0, b], twist[1, b], twist[2, b], wx, wy, wz)
        for r in range(3):
            T[r, 0, b], T[r, 1, b], T[r, 2, b], T[r, 3, b] = (
                rows[r][0],
                rows[r][1],
                rows[r][2],
                p[r],
            )


@part
def _largest_of(a, b):
    return where(a > b, a, b)


@part
def quaternion_of_rotation(a, b, c):
    """Return the unit quaternion with w >= 0 of a rotation with the rows a, b and c.

    The formula divides by the largest component.
    """
    # four times the squares of x, y, z, w
    xx, yy = 1.0 + a[0] - b[1] - c[2], 1.0 - a[0] + b[1] - c[2]
    zz, ww = 1.0 - a[0] - b[1] + c[2], 1.0 + a[0] + b[1] + c[2]
    xy, xz, yz = b[0] + a[1], a[2] + c[0], c[1] + b[2]
    xw, yw, zw = c[1] - b[2], a[2] - c[0], b[0] - a[1]
    by_y = yy >= zz
    x, y, z, w = where(by_y, xy, xz), where(by_y, yy, yz), where(by_y, yz, zz), where(by_y, yw, zw)
    by_x = xx >= _largest_of(yy, zz)
    x, y, z, w = where(by_x, xx, x), where(by_x, xy, y), where(by_x, xz, z), where(by_x, xw, w)
    by_w = ww >= _largest_of(_largest_of(xx, yy), zz)
    x, y, z, w = where(by_w, xw, x), where(by_w, yw, y), where(by_w, zw, z), where(by_w, ww, w)
    scale = copy_sign(1.0 / sqrt(x * x + y * y + z * z + w * w), w)
    return x * scale, y * scale, z * scale, w * scale


@part
def log_quaternion(x, y, z, w):
    """Return the rotation vector theta u of a unit quaternion, theta in [0, pi].

    The sign of u is arbitrary at theta = pi.
    """
    sine = sqrt(x * x + y * y + z * z)
    scale = where(sine > 0.0, 2.0 * arc_tangent(sine, w) / where(sine > 0.0, sine, 1.0), 2.0)
    return scale * x, scale * y, scale * z


@entry("float64[:, :, ::1], out float64[:, ::1]")
def rotation_to_quaternion(T, quaternion):
    """Compute the unit quaternion[4, b] with w >= 0 of the rotation in T[3, 4, b]."""
    for b in range(T.shape[2]):
        x, y, z, w = quaternion_of_rotation(T[0, :, b], T[1, :, b], T[2, :, b])
        quaternion[0, b], quaternion[1, b], quaternion[2, b], quaternion[3, b] = x, y, z, w


@entry("float64[:, ::1], out float64[:, ::1]", inline="always")
def rotation_vector(quaternion, w):
    """Compute w[3, b] = theta u of a unit quaternion[4, b], theta in [0, pi]."""
    for b in range(quaternion.shape[1]):
        x, y, z = quaternion[0, b], quaternion[1, b], quaternion[2, b]
        w[0, b], w[1, b], w[2, b] = log_quaternion(x, y, z, quaternion[3, b])
