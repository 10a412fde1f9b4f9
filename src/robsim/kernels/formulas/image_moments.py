"""Image moments of a planar region or of a set of marks, and their rates by the camera's twist.

The moments are stored as centre[2, b] = (xg, yg) and centred moments mu[k, b] with
k = `moment_index(i, j)`, in ascending order: mu00, mu10, mu01, mu20, mu11, mu02, mu30, ... mu00 is
the area of a region or the number of marks. mu10 and mu01 are zero, and their rows of the rates
hold the rates of the centre.
"""

import math

import numpy as np

from robsim.kernels.formulas.interaction import put_point_rates
from robsim.kernels.formulas.lane_vectors import put_vector
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import copy_sign, get, put

NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))  # Gauss-Legendre nodes on [0, 1]
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)  # exact up to the fifth power
ORDER_3, ORDER_4 = 10, 15  # number of moments up to these orders


@kernel
def moment_index(i, j):
    """Return the index of the moment of x^i y^j."""
    return (i + j) * (i + j + 1) // 2 + j


@entry("int64 -> int64, int64")
def moment_powers(k):
    """Return the powers (i, j) of the moment with index k."""
    order = 0
    while (order + 1) * (order + 2) // 2 <= k:
        order += 1
    j = k - order * (order + 1) // 2
    return order - j, j


@part
def _add_monomials(w, terms, u, v, count, m):
    """Compute terms[k] = terms[0] u^i v^j for k = `moment_index(i, j)`, and add them to m."""
    put(w, m, get(w, m) + get(w, terms))
    k, order = 1, 1
    while k < count:
        for j in range(order + 1):
            term = get(w, terms + k - order) * u if j < order else get(w, terms + k - order - 1) * v
            put(w, terms + k, term)
            put(w, m + k, get(w, m + k) + term)
            k += 1
        order += 1


@kernel
def _put_polygon_moments(w, N, points, x, y, count, terms, m):
    """Compute `count` signed moments m about (x, y) of the polygon with N corners.

    By Green's theorem a polygon is the sum of the triangles from the origin to its edges
    p + t (q - p). The integral of a monomial f of order d over a triangle is (p x q) / (d + 2)
    times the integral of f(p + t (q - p)) over 0 <= t <= 1. Three Gauss-Legendre nodes are exact up
    to d = 5. The sums equal the formulas of Steger (1996), On the calculation of arbitrary moments
    of polygons, TU Munich, FGBV-96-05.
    """
    for k in range(count):
        put(w, m + k, 0.0)
    for n in range(N):
        p, q = points + 2 * n, points + 2 * ((n + 1) % N)
        px, py, qx, qy = get(w, p) - x, get(w, p + 1) - y, get(w, q) - x, get(w, q + 1) - y
        for g in range(3):
            put(w, terms, WEIGHTS[g] * (px * qy - qx * py))
            u, v = px + NODES[g] * (qx - px), py + NODES[g] * (qy - py)
            _add_monomials(w, terms, u, v, count, m)
    for k in range(count):
        i, j = moment_powers(k)
        put(w, m + k, get(w, m + k) / (i + j + 2))


@part
def put_region_moments(w, N, points, centre, mu, terms):
    """Compute the centre (2,) and the moments mu up to order 4 of the polygon with N corners.

    The corners follow the border in either orientation. The border must not cross itself. The area
    is positive in both orientations. `terms` are scratch rows, as many as moments.
    """
    x, y = get(w, points), get(w, points + 1)
    _put_polygon_moments(w, N, points, x, y, 3, terms, mu)
    area = get(w, mu)
    x, y = x + get(w, mu + 1) / area, y + get(w, mu + 2) / area
    put(w, centre, x)
    put(w, centre + 1, y)
    _put_polygon_moments(w, N, points, x, y, ORDER_4, terms, mu)
    for k in range(ORDER_4):
        put(w, mu + k, copy_sign(1.0, area) * get(w, mu + k))
    put(w, mu + 1, 0.0)
    put(w, mu + 2, 0.0)


@part
def put_mark_moments(w, N, points, centre, mu):
    """Compute the centre (2,) and mu, up to order 3, of N marks: sum (x - xg)^i (y - yg)^j."""
    zero = 0.0 * get(w, points)
    x, y, uu, uv, vv, uuu, uuv, uvv, vvv = zero, zero, zero, zero, zero, zero, zero, zero, zero
    for n in range(N):
        x, y = x + get(w, points + 2 * n) / N, y + get(w, points + 2 * n + 1) / N
    for n in range(N):
        u, v = get(w, points + 2 * n) - x, get(w, points + 2 * n + 1) - y
        uu, uv, vv = uu + u * u, uv + v * u, vv + v * v
        uuu, uuv, uvv, vvv = uuu + u * u * u, uuv + v * u * u, uvv + v * v * u, vvv + v * v * v
    put(w, centre, x)
    put(w, centre + 1, y)
    put_vector(w, mu, N + zero, zero, zero)
    put_vector(w, mu + 3, uu, uv, vv)
    put_vector(w, mu + 6, uuu, uuv, uvv)
    put(w, mu + 9, vvv)


@kernel
def mean_point(x, centre):
    """Compute centre[2, b], the mean of the points x[n, 2, b]."""
    centre[:] = 0.0
    for n in range(x.shape[0]):
        for r in range(2):
            for b in range(x.shape[2]):
                centre[r, b] += x[n, r, b] / x.shape[0]


@entry("float64[:, :, ::1], float64[:, ::1], out float64[:, ::1]", inline="always")
def fit_inverse_depth_plane(x, Z, ABC):
    """Compute ABC[3, b] of the plane 1/Z = A x + B y + C through marks x[n, 2, b] at depths Z.

    The fit is a least-squares fit of the inverse depths. It is exact if the marks are in a plane
    that does not contain the camera's centre.
    """
    centre, sums = np.empty((2, x.shape[2])), np.zeros((6, x.shape[2]))
    mean_point(x, centre)
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            sums[5, b] += 1.0 / Z[n, b] / x.shape[0]
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            u, v = x[n, 0, b] - centre[0, b], x[n, 1, b] - centre[1, b]
            w = 1.0 / Z[n, b] - sums[5, b]
            sums[0, b] += u * u
            sums[1, b] += u * v
            sums[2, b] += v * v
            sums[3, b] += u * w
            sums[4, b] += v * w
    for b in range(x.shape[2]):
        uu, uv, vv = sums[0, b], sums[1, b], sums[2, b]
        uw, vw, iz = sums[3, b], sums[4, b], sums[5, b]
        det = uu * vv - uv * uv
        A, B = (vv * uw - uv * vw) / det, (uu * vw - uv * uw) / det
        ABC[0, b], ABC[1, b] = A, B
        ABC[2, b] = iz - A * centre[0, b] - B * centre[1, b]


@part
def _centre_rates(ABC, centre, mu, R):
    """Compute rows 1 and 2 of R, for the centre of gravity of a region."""
    for b in range(mu.shape[1]):
        A, B, C = ABC[0, b], ABC[1, b], ABC[2, b]
        x, y, area = centre[0, b], centre[1, b], mu[0, b]
        iz = A * x + B * y + C
        xx, xy, yy = 4.0 * mu[3, b] / area, 4.0 * mu[4, b] / area, 4.0 * mu[5, b] / area
        R[1, 0, b], R[1, 1, b], R[1, 2, b] = -iz, 0.0, x * iz + A * xx + B * xy
        R[1, 3, b], R[1, 4, b], R[1, 5, b] = x * y + xy, -(1.0 + x * x + xx), y
        R[2, 0, b], R[2, 1, b], R[2, 2, b] = 0.0, -iz, y * iz + A * xy + B * yy
        R[2, 3, b], R[2, 4, b], R[2, 5, b] = 1.0 + y * y + yy, -(x * y + xy), -x


@part
def region_moment_rates(ABC, centre, mu, R):
    """Compute R[k, 6, b] of (mu00, xg, yg, mu20, mu11, ...) of a region in the plane ABC[3, b].

    These are the interaction matrices of the area, the centre of gravity and the centred moments in
    Chaumette (2004), Image moments: a general and useful set of features for visual servoing, IEEE
    T-RO 20, with n_ij = mu_ij / a. Rows up to order d need mu up to order d + 1.
    """
    for k in range(R.shape[0]):
        i, j = moment_powers(k)
        here, right, below = moment_index(i, j), moment_index(i + 1, j), moment_index(i, j + 1)
        left, skew = (
            (moment_index(i - 1, j), moment_index(i - 1, j + 1)) if i > 0 else (0, 0)
        )  # factor i is then 0
        up, back = (moment_index(i, j - 1), moment_index(i + 1, j - 1)) if j > 0 else (0, 0)
        for b in range(mu.shape[1]):
            A, B, C = ABC[0, b], ABC[1, b], ABC[2, b]
            x, y, m = centre[0, b], centre[1, b], mu[here, b]
            xx, xy, yy = mu[3, b] / mu[0, b], mu[4, b] / mu[0, b], mu[5, b] / mu[0, b]
            wx = (
                (i + j + 3) * mu[below, b] + (i + 2 * j + 3) * y * m + i * x * mu[skew, b]
            ) - 4.0 * (i * xy * mu[left, b] + j * yy * mu[up, b])
            wy = -((i + j + 3) * mu[right, b] + (2 * i + j + 3) * x * m + j * y * mu[back, b]) + (
                4.0 * (i * xx * mu[left, b] + j * xy * mu[up, b])
            )
            R[k, 0, b] = -(i + 1) * A * m - i * B * mu[skew, b]
            R[k, 1, b] = -(j + 1) * B * m - j * A * mu[back, b]
            R[k, 2, b] = -A * wy + B * wx + (i + j + 2) * C * m
            R[k, 3, b], R[k, 4, b], R[k, 5, b] = wx, wy, i * mu[skew, b] - j * mu[back, b]
    _centre_rates(ABC, centre, mu, R)


@part
def mark_moment_rates(w, N, points, depth, centre, R, L):
    """Compute R (k, 6), the rates of (N, xg, yg, mu20, mu11, ...) of N marks, up to order 3.

    The rates follow by the chain rule from the interaction matrix of each mark, so the marks need
    not be coplanar. For coplanar marks they equal the rates of Tahri and Chaumette (2005),
    Point-based and region-based image moments for visual servoing of planar objects, IEEE T-RO
    21(6). `L` (2 N, 6) are scratch rows.
    """
    zero = 0.0 * get(w, centre)
    for n in range(N):
        x, y = get(w, points + 2 * n), get(w, points + 2 * n + 1)
        put_point_rates(w, L + 12 * n, x, y, 1.0 / get(w, depth + n))
    for i in range(12):
        rate = zero
        for n in range(N):
            rate = rate + get(w, L + 12 * n + i) / N
        put(w, R + 6 + i, rate)
    for c in range(6):
        put(w, R + c, 0.0)
        _put_moment_rates(w, N, points, centre, L + c, R + c, zero)


@part
def _put_moment_rates(w, N, points, centre, L, R, zero):
    """Write the rates of the moments of order 2 and 3 by one component of the twist."""
    uu, uv, vv, uuu, uuv, uvv, vvv = zero, zero, zero, zero, zero, zero, zero
    for n in range(N):
        u = get(w, points + 2 * n) - get(w, centre)
        v = get(w, points + 2 * n + 1) - get(w, centre + 1)
        du, dv = get(w, L + 12 * n) - get(w, R + 6), get(w, L + 12 * n + 6) - get(w, R + 12)
        uu, uv, vv = uu + 2.0 * u * du, uv + (v * du + u * dv), vv + 2.0 * v * dv
        uuu, vvv = uuu + 3.0 * (u * u) * du, vvv + 3.0 * (v * v) * dv
        uuv = uuv + (2.0 * (v * u) * du + u * u * dv)
        uvv = uvv + (v * v * du + 2.0 * (v * u) * dv)
    put(w, R + 18, uu)
    put(w, R + 24, uv)
    put(w, R + 30, vv)
    put(w, R + 36, uuu)
    put(w, R + 42, uuv)
    put(w, R + 48, uvv)
    put(w, R + 54, vvv)
