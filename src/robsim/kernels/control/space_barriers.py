"""Barriers of space: rows C qd >= bound that keep points and lines of sight clear.

A barrier h >= 0 changes by dh/dt = C qd + d, where prescribed motions cause d. The row

    C qd >= -alpha h - d

lets h decay no faster than exponentially with the rate alpha (Ames et al., Control Barrier
Functions: Theory and Applications, European Control Conference 2019, eq. 7). The rate is at most
1/dt, with which a barrier that changes at a constant rate reaches zero after one period dt.
"""

import numpy as np

from robsim.kernels.control.view_barriers import limit_rate
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, get, put, sqrt, where
from robsim.kernels.machine.stages import stage


@part
def _load_three(w, first, stride):
    """Return three rows at a stride `stride`."""
    return get(w, first), get(w, first + stride), get(w, first + 2 * stride)


@part
def _dot(a, b):
    """Return the dot product of two vectors of three components."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def _subtract(a, b):
    """Return the difference of two vectors of three components."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def _interpolate(a, b, share):
    """Return the vector at a share of the way from a to b."""
    return (
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
    )


@part
def _divide(x, y):
    """Return x / y, or 0 where y is 0."""
    return where(y > 0.0, x / where(y > 0.0, y, 1.0), 0.0 * x)


@part
def _clip_share(x):
    """Return x clipped to 0..1."""
    return where(x > 0.0, where(x < 1.0, x, 1.0), 0.0 * x)


@part
def _nearest_shares(a, a_end, b, b_end):
    """Return the shares s and t of the nearest points of two line segments.

    Either segment may be a point. Of parallel segments the first nearest pair is taken (Ericson,
    Real-Time Collision Detection, 2005, section 5.1.9).
    """
    u, v, r = _subtract(a_end, a), _subtract(b_end, b), _subtract(a, b)
    uu, vv, uv, ur, vr = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, r), _dot(v, r)
    sine = uu * vv - uv * uv
    s = where(sine > 1e-12 * uu * vv, _clip_share(_divide(uv * vr - ur * vv, sine)), 0.0 * uu)
    t = _clip_share(_divide(uv * s + vr, vv))
    return _clip_share(_divide(uv * t - ur, uu)), t


@part
def _unit_of_gap(gap):
    """Return the length of a vector, and its direction; z for a vector of length 0."""
    length = sqrt(_dot(gap, gap))
    z = where(length > 0.0, _divide(gap[2], length), 1.0)
    return length, (_divide(gap[0], length), _divide(gap[1], length), z)


@stage
def bound_planes(
    w,
    step,
    T="3, 4",
    J="6, n",
    drift="6",
    n="count",
    planes="m, 4",
    m="count",
    rate="row",
    dt="row",
    C="m, n",
    bound="m",
):
    """Compute the rows of h = N p - offset for m planes (N, offset) and the origin p of a frame.

    J and `drift` are its Jacobian and its twist by prescribed motions, in world axes.
    """
    alpha, p = limit_rate(get(w, rate), get(w, dt)), _load_three(w, T + 3, 4)
    for i in range(m):
        normal = _load_three(w, planes + 4 * i, 1)
        h = _dot(normal, p) - get(w, planes + 4 * i + 3)
        for j in range(n):
            put(w, C + n * i + j, _dot(normal, _load_three(w, J + j, n)))
        put(w, bound + i, -(alpha * h) - _dot(normal, _load_three(w, drift, 1)))


@part
def _relative_velocity(w, rows, stride, s, t):
    """Return the velocity of the second of two nearest points relative to the first.

    `rows` are the first rows of the velocities of both ends of the first segment, then of the
    second.
    """
    a = _interpolate(_load_three(w, rows[0], stride), _load_three(w, rows[1], stride), s)
    b = _interpolate(_load_three(w, rows[2], stride), _load_three(w, rows[3], stride), t)
    return _subtract(b, a)


@stage
def bound_clearance(
    w,
    step,
    n="count",
    poses="each: 3, 4",
    jacobians="each: 6, n",
    drifts="each: 6",
    least="row",
    rate="row",
    dt="row",
    C="1, n",
    bound="1",
):
    """Compute the row of h = distance of two line segments - least.

    The ends of a segment are the origins of two frames. The four poses are those of the first
    segment and then of the second, with the Jacobians and the twists by prescribed motions in
    world axes. The nearest points may move along their segments: the derivative of the least
    distance is the derivative at constant shares.
    """
    a, a_end = _load_three(w, poses[1] + 3, 4), _load_three(w, poses[2] + 3, 4)
    b, b_end = _load_three(w, poses[3] + 3, 4), _load_three(w, poses[4] + 3, 4)
    s, t = _nearest_shares(a, a_end, b, b_end)
    gap = _subtract(_interpolate(b, b_end, t), _interpolate(a, a_end, s))
    length, unit = _unit_of_gap(gap)
    for j in range(n):
        ends = jacobians[1] + j, jacobians[2] + j, jacobians[3] + j, jacobians[4] + j
        put(w, C + j, _dot(unit, _relative_velocity(w, ends, n, s, t)))
    ends = drifts[1], drifts[2], drifts[3], drifts[4]
    rate_of_world = _dot(unit, _relative_velocity(w, ends, 1, s, t))
    h = length - get(w, least)
    put(w, bound, -(limit_rate(get(w, rate), get(w, dt)) * h) - rate_of_world)


@part
def _velocity_in_camera(w, J, stride, p):
    """Return the velocity -(v + omega x p) of a point p by the camera's relative twist."""
    v, o = _load_three(w, J, stride), _load_three(w, J + 3 * stride, stride)
    return (
        -(v[0] + (o[1] * p[2] - o[2] * p[1])),
        -(v[1] + (o[2] * p[0] - o[0] * p[2])),
        -(v[2] + (o[0] * p[1] - o[1] * p[0])),
    )


@part
def _gap_rate(w, rows, stride, points, s, t, unit):
    """Return the rate of the distance between a line of sight and an occluding segment.

    `rows` and `points` belong to the mark, and to both ends of the segment.
    """
    mark = _velocity_in_camera(w, rows[0], stride, points[0])
    start = _velocity_in_camera(w, rows[1], stride, points[1])
    end = _velocity_in_camera(w, rows[2], stride, points[2])
    b = _interpolate(start, end, t)
    return _dot(unit, (b[0] - s * mark[0], b[1] - s * mark[1], b[2] - s * mark[2]))


@stage
def bound_occlusions(
    w,
    step,
    n="count",
    N="count",
    points="N, 2",
    depths="N",
    hidden="N or none",
    start="3, 4",
    end="3, 4",
    jacobians="each: 6, n",
    drifts="each: 6",
    radius="row",
    rate="row",
    dt="row",
    C="N, n",
    bound="N",
):
    """Compute the rows of h = distance from a line of sight to an occluding segment - radius.

    The line of sight to a mark runs from the camera to the mark, at normalised `points` and
    `depths`. `start` and `end` are the poses of the ends of the segment in the camera. The
    Jacobians are of the camera relative to the target, to the start and to the end, in camera
    axes, and `drifts` the same twists by prescribed motions. The bound of a mark without an image
    is -inf.
    """
    alpha = limit_rate(get(w, rate), get(w, dt))
    b, b_end = _load_three(w, start + 3, 4), _load_three(w, end + 3, 4)
    zero = 0.0 * alpha
    for i in range(N):
        Z = get(w, depths + i)
        mark = get(w, points + 2 * i) * Z, get(w, points + 2 * i + 1) * Z, Z
        is_seen = (absolute(mark[0]) < np.inf) & (absolute(mark[1]) < np.inf) & (Z > 0.0)
        if hidden >= 0:
            is_seen = is_seen & ~(get(w, hidden + i) > 0.0)
        s, t = _nearest_shares((zero, zero, zero), mark, b, b_end)
        c = _interpolate(b, b_end, t)
        length, unit = _unit_of_gap((c[0] - s * mark[0], c[1] - s * mark[1], c[2] - s * mark[2]))
        ends = mark, b, b_end
        for j in range(n):
            rows = jacobians[1] + j, jacobians[2] + j, jacobians[3] + j
            change = _gap_rate(w, rows, n, ends, s, t, unit)
            put(w, C + n * i + j, where(is_seen, change, 0.0))
        rows = drifts[1], drifts[2], drifts[3]
        d = _gap_rate(w, rows, 1, ends, s, t, unit)
        least_rate = -(alpha * (length - get(w, radius))) - d
        put(w, bound + i, where(is_seen, least_rate, -np.inf))
