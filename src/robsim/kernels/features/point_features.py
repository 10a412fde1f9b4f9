"""Features of single marks: image points, polar coordinates, bearings, depth, points in space.

The interaction matrix satisfies sdot = L V_c with the camera's twist V_c = (v, omega) in its axes.
"""

import math

import numpy as np

from robsim.kernels.formulas.interaction import points_interaction, put_point_rates
from robsim.kernels.formulas.perspective import pinhole_pixel
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage


@kernel
def to_polar(x, y):
    """Return (rho, theta) of the vector (x, y)."""
    return math.sqrt(x * x + y * y), math.atan2(y, x)


@kernel
def polar_rates(x, y, dx, dy):
    """Return the rates (rho', theta') of the vector (x, y) with the rate (dx, dy)."""
    rho = math.sqrt(x * x + y * y)
    c, s = x / rho, y / rho
    return c * dx + s * dy, (c * dy - s * dx) / rho


@kernel
def polar_features(x, s):
    """Compute s[2n, b] = (rho, theta) of image points x[n, 2, b] about the principal point."""
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            s[2 * n, b], s[2 * n + 1, b] = to_polar(x[n, 0, b], x[n, 1, b])


@kernel
def to_polar_rates(x, L):
    """Convert L of the points x[n, 2, b] to L of `polar_features`, in place."""
    for n in range(x.shape[0]):
        i, j = 2 * n, 2 * n + 1
        for c in range(6):
            for b in range(x.shape[2]):
                L[i, c, b], L[j, c, b] = polar_rates(x[n, 0, b], x[n, 1, b], L[i, c, b], L[j, c, b])


@kernel
def unwrap_angles(goal, group, s):
    """Shift the angles of s[k, b] by whole turns to within half a turn of the goal.

    The angles are the last of each `group` rows. An angle near the goal keeps its bits.
    """
    for i in range(group - 1, s.shape[0], group):
        for b in range(s.shape[1]):
            half_turn_less = s[i, b] - goal[i, b] - math.pi
            s[i, b] -= 2.0 * math.pi * np.ceil(half_turn_less / (2.0 * math.pi))


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
    """Compute s and L of polar coordinates, with angles near the goal's angles."""
    x, s, L = matrix(w, points, N, 2), vector(w, s, 2 * N), matrix(w, L, 2 * N, 6)
    polar_features(x, s)
    if goal >= 0:
        unwrap_angles(vector(w, goal, 2 * N), 2, s)
    points_interaction(x, vector(w, depth, N), L)
    to_polar_rates(x, L)


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
