"""Composite-rigid-body algorithm: the mass matrix of the joints (Featherstone 2008, table 6.2)."""

from robsim.kernels.dynamics.articulated_bodies import rotate_symmetric
from robsim.kernels.dynamics.body_motion import FORCE, INERTIA, MOMENT, P, R
from robsim.kernels.dynamics.vector_lanes import add_vector, cross, get_vector, put_vector, rotate
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import align_stack, get, put
from robsim.kernels.machine.routine import routine
from robsim.kernels.machine.stages import stage

TOTAL = INERTIA  # ten rows: mass, first moments and second moments of a composite body


@routine
def _carry_composite(w, parent, body):
    """Add the composite inertia of a body to that of its parent, about the parent's origin."""
    m = get(w, body + TOTAL)
    hx, hy, hz = get_vector(w, body + TOTAL + 1)
    px, py, pz = get_vector(w, body + P)
    rx, ry, rz = rotate(w, body + R, hx, hy, hz)
    put(w, parent + TOTAL, get(w, parent + TOTAL) + m)
    add_vector(w, parent + TOTAL + 1, rx + m * px, ry + m * py, rz + m * pz)
    xx, xy, xz, yy, yz, zz = rotate_symmetric(w, body + R, body + TOTAL + 4)
    qx, qy, qz = 2.0 * rx + m * px, 2.0 * ry + m * py, 2.0 * rz + m * pz
    t = px * qx + py * qy + pz * qz
    xy, xz = xy - (px * ry + rx * py + m * px * py), xz - (px * rz + rx * pz + m * px * pz)
    yz = yz - (py * rz + ry * pz + m * py * pz)
    add_vector(w, parent + TOTAL + 4, xx + t - px * qx, xy, xz)
    add_vector(w, parent + TOTAL + 7, yy + t - py * qy, yz, zz + t - pz * qz)


@part
def _start_force(w, body, turns):
    """Write the force and moment of a unit acceleration of the joint of a composite body."""
    m = get(w, body + TOTAL)
    zero = 0.0 * m
    hx, hy = get(w, body + TOTAL + 1), get(w, body + TOTAL + 2)
    if turns:
        put_vector(w, body + FORCE, -hy, hx, zero)
        n0, n1 = get(w, body + TOTAL + 6), get(w, body + TOTAL + 8)
        put_vector(w, body + MOMENT, n0, n1, get(w, body + TOTAL + 9))
    else:
        put_vector(w, body + FORCE, zero, zero, m)
        put_vector(w, body + MOMENT, hy, -hx, zero)


@part
def _lift_force(w, body):
    """Transform the force and moment on a body to the axes and the origin of its parent."""
    fx, fy, fz = get_vector(w, body + FORCE)
    nx, ny, nz = get_vector(w, body + MOMENT)
    fx, fy, fz = rotate(w, body + R, fx, fy, fz)
    nx, ny, nz = rotate(w, body + R, nx, ny, nz)
    px, py, pz = get_vector(w, body + P)
    dx, dy, dz = cross(px, py, pz, fx, fy, fz)
    return fx, fy, fz, nx + dx, ny + dy, nz + dz


@stage
def compute_mass_matrix(
    w,
    step,
    H="n, n",
    n="count",
    each="each: above=whole; column=whole; body=62; inertia=10; turns=whole",
):
    """Compute the mass matrix H of joints.

    `column` is the number of the joint of a body, and `above` the number of its parent, or -1 if
    the parent is a carrier. Parents come before their children.
    """
    align_stack()
    for i in range(n * n):
        put(w, H + i, 0.0)
    for i in range(each[0]):
        for k in range(10):
            put(w, each[5 * i + 3] + TOTAL + k, get(w, each[5 * i + 4] + k))
    for i in range(each[0] - 1, -1, -1):
        above, column, body, turns = (
            each[5 * i + 1],
            each[5 * i + 2],
            each[5 * i + 3],
            each[5 * i + 5],
        )
        if above >= 0:
            _carry_composite(w, each[5 * above + 3], body)
        _start_force(w, body, turns)
        put(w, H + (n + 1) * column, get(w, body + (MOMENT + 2 if turns else FORCE + 2)))
        j = i
        while each[5 * j + 1] >= 0:
            fx, fy, fz, nx, ny, nz = _lift_force(w, each[5 * j + 3])
            j = each[5 * j + 1]
            here, other = each[5 * j + 3], each[5 * j + 2]
            put_vector(w, here + FORCE, fx, fy, fz)
            put_vector(w, here + MOMENT, nx, ny, nz)
            value = get(w, here + (MOMENT + 2 if each[5 * j + 5] else FORCE + 2))
            put(w, H + n * column + other, value)
            put(w, H + n * other + column, value)
