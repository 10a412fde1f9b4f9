"""Features of single marks: image points, polar coordinates, bearings, depth, points in space.

The interaction matrix satisfies sdot = L V_c with the camera's twist V_c = (v, omega) in its axes.
"""

import math

from robsim.kernels.formulas.interaction import put_point_rates
from robsim.kernels.formulas.lane_math import arc_tangent
from robsim.kernels.formulas.perspective import pinhole_pixel
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import floor, get, put, sqrt
from robsim.kernels.machine.stages import stage


@part
def to_polar(x, y):
    """Return (rho, theta) of the vector (x, y)."""
    return sqrt(x * x + y * y), arc_tangent(y, x)


@part
def put_polar_rates(w, L, x, y):
    """Convert the rates of a vector (x, y), the two rows of L (2, 6), to those of (rho, theta)."""
    rho = sqrt(x * x + y * y)
    c, s = x / rho, y / rho
    for i in range(6):
        dx, dy = get(w, L + i), get(w, L + 6 + i)
        put(w, L + i, c * dx + s * dy)
        put(w, L + 6 + i, (c * dy - s * dx) / rho)


@part
def unwrap_angle(w, goal, s):
    """Shift the angle s by whole turns to within half a turn of the goal.

    An angle near the goal keeps its bits.
    """
    half_turn_less = get(w, s) - get(w, goal) - math.pi
    put(w, s, get(w, s) + 2.0 * math.pi * floor(-half_turn_less / (2.0 * math.pi)))


@kernel
def bearings(x, s):
    """Compute s[3n, b], the unit vectors to image points x[n, 2, b], in camera axes."""
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            u, v = x[n, 0, b], x[n, 1, b]
            z = 1.0 / math.sqrt(1.0 + u * u + v * v)
            s[3 * n, b], s[3 * n + 1, b], s[3 * n + 2, b] = u * z, v * z, z


@kernel
def bearings_interaction(s, Z, L):
    """Compute L[3n, 6, b] = [-(I - s s') / |P|, [s]x] of bearings s at depths Z."""
    for i in range(s.shape[0]):
        first = i - i % 3
        for c in range(3):
            one = 1.0 if i == first + c else 0.0
            for b in range(s.shape[1]):
                distance = Z[i // 3, b] / s[first + 2, b]
                L[i, c, b] = (s[i, b] * s[first + c, b] - one) / distance
    cross_columns(s, L)


@part
def cross_columns(s, L):
    """Compute L[3n:3n+3, 3:6, b] = [s]x, for vectors s[3n, b] under a camera's rotation."""
    for i in range(0, s.shape[0], 3):
        for b in range(s.shape[1]):
            x, y, z = s[i, b], s[i + 1, b], s[i + 2, b]
            L[i, 3, b], L[i, 4, b], L[i, 5, b] = 0.0, -z, y
            L[i + 1, 3, b], L[i + 1, 4, b], L[i + 1, 5, b] = z, 0.0, -x
            L[i + 2, 3, b], L[i + 2, 4, b], L[i + 2, 5, b] = -y, x, 0.0


@kernel
def points_3d(x, Z, X):
    """Compute X[3n, b] = (x Z, y Z, Z) of image points x[n, 2, b] at depths Z[n, b]."""
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            X[3 * n, b], X[3 * n + 1, b] = x[n, 0, b] * Z[n, b], x[n, 1, b] * Z[n, b]
            X[3 * n + 2, b] = Z[n, b]


@part
def points_3d_interaction(X, L):
    """Compute L[3n, 6, b] = [-I, [X]x] of points X[3n, b] in camera axes."""
    for i in range(X.shape[0]):
        for c in range(3):
            minus_one = -1.0 if c == i % 3 else 0.0
            for b in range(X.shape[1]):
                L[i, c, b] = minus_one
    cross_columns(X, L)


@kernel
def log_depth(Z, Z_goal, s):
    """Compute s[n, b] = log(Z / Z_goal) of depths Z[n, b] and Z_goal[n, b]."""
    for n in range(Z.shape[0]):
        for b in range(Z.shape[1]):
            s[n, b] = math.log(Z[n, b] / Z_goal[n, b])


@kernel
def log_depth_interaction(x, Z, L):
    """Compute L[n, 6, b] = [0, 0, -1/Z, -y, x, 0] of image points x at depths Z[n, b]."""
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            L[n, 0, b], L[n, 1, b], L[n, 2, b] = 0.0, 0.0, -1.0 / Z[n, b]
            L[n, 3, b], L[n, 4, b], L[n, 5, b] = -x[n, 1, b], x[n, 0, b], 0.0


@stage
def polar_stage(
    w, step, N="count", points="N, 2", depth="N", goal="2*N or none", s="2*N", L="2*N, 6"
):
    """Compute s and L of polar coordinates (rho, theta), with angles near the goal's angles.

    They are about the principal point.
    """
    for i in range(0, 2 * N, 2):
        x, y = get(w, points + i), get(w, points + i + 1)
        rho, theta = to_polar(x, y)
        put(w, s + i, rho)
        put(w, s + i + 1, theta)
        if goal >= 0:
            unwrap_angle(w, goal + i + 1, s + i + 1)
        put_point_rates(w, L + 6 * i, x, y, 1.0 / get(w, depth + i // 2))
        put_polar_rates(w, L + 6 * i, x, y)


@stage
def bearings_stage(w, step, N="count", points="N, 2", depth="N", s="3*N", L="3*N, 6"):
    """Compute s and L of unit vectors to the marks."""
    s = vector(w, s, 3 * N)
    bearings(matrix(w, points, N, 2), s)
    bearings_interaction(s, vector(w, depth, N), matrix(w, L, 3 * N, 6))


@stage
def points_3d_stage(w, step, N="count", points="N, 2", depth="N", s="3*N", L="3*N, 6"):
    """Compute s and L of points in camera axes."""
    s = vector(w, s, 3 * N)
    points_3d(matrix(w, points, N, 2), vector(w, depth, N), s)
    points_3d_interaction(s, matrix(w, L, 3 * N, 6))


@stage
def log_depth_stage(w, step, N="count", points="N, 2", depth="N", goal="N", s="N", L="N, 6"):
    """Compute s and L of the logarithm of depths relative to the goal."""
    x, Z = matrix(w, points, N, 2), vector(w, depth, N)
    log_depth(Z, vector(w, goal, N), vector(w, s, N))
    log_depth_interaction(x, Z, matrix(w, L, N, 6))


@stage
def points_stage(w, step, N="count", points="N, 2", depth="N", s="2*N", L="2*N, 6"):
    """Compute s and L of normalised image points."""
    for n in range(N):
        x, y, inverse = get(w, points + 2 * n), get(w, points + 2 * n + 1), 1.0 / get(w, depth + n)
        put(w, s + 2 * n, x)
        put(w, s + 2 * n + 1, y)
        put_point_rates(w, L + 12 * n, x, y, inverse)


@stage
def pixels_stage(w, step, N="count", camera="22", s="2*N", L="2*N, 6"):
    """Convert s and L of normalised image points to pixels, in place."""
    K = camera
    for n in range(N):
        x, y, row = get(w, s + 2 * n), get(w, s + 2 * n + 1), L + 12 * n
        u, v = pinhole_pixel(
            x, y, get(w, K), get(w, K + 1), get(w, K + 2), get(w, K + 4), get(w, K + 5)
        )
        put(w, s + 2 * n, u)
        put(w, s + 2 * n + 1, v)
        for c in range(6):
            below = get(w, row + 6 + c)
            put(w, row + c, get(w, K) * get(w, row + c) + get(w, K + 1) * below)
            put(w, row + 6 + c, get(w, K + 4) * below)
