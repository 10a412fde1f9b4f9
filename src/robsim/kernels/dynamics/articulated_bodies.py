"""Articulated-body algorithm: joint accelerations from torques (Featherstone 2008, table 7.1)."""

from robsim.kernels.dynamics.body_motion import (
    ACCELERATION,
    ALPHA,
    C_ACCELERATION,
    C_ALPHA,
    COUPLING,
    D_INVERSE,
    FORCE,
    INERTIA,
    MASS,
    MOMENT,
    OMEGA,
    U_FORCE,
    U_MOMENT,
    P,
    R,
    U,
)
from robsim.kernels.dynamics.vector_lanes import (
    add_vector,
    cross,
    get_vector,
    put_vector,
    rotate,
    rotate_back,
    times_symmetric,
)
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import align_stack, get, put
from robsim.kernels.machine.routine import routine
from robsim.kernels.machine.stages import stage


@part
def _turn_body(w, parent, body, v, turns):
    """Compute the angular velocity of a body, and the velocity products of its acceleration."""
    ox, oy, oz = get_vector(w, parent + OMEGA)
    px, py, pz = get_vector(w, body + P)
    ux, uy, uz = cross(ox, oy, oz, px, py, pz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    cx, cy, cz = rotate_back(w, body + R, cx, cy, cz)
    ox, oy, oz = rotate_back(w, body + R, ox, oy, oz)
    zero = 0.0 * v
    if turns:
        put_vector(w, body + C_ALPHA, oy * v, -ox * v, zero)
        oz = oz + v
    else:
        put_vector(w, body + C_ALPHA, zero, zero, zero)
        cx, cy = cx + 2.0 * oy * v, cy - 2.0 * ox * v
    put_vector(w, body + C_ACCELERATION, cx, cy, cz)
    put_vector(w, body + OMEGA, ox, oy, oz)


@part
def _begin_articulated_body(w, body, inertia):
    """Start an articulated body with its own inertia and bias force."""
    m = get(w, inertia)
    zero = 0.0 * m
    hx, hy, hz = get_vector(w, inertia + 1)
    ox, oy, oz = get_vector(w, body + OMEGA)
    ux, uy, uz = cross(ox, oy, oz, hx, hy, hz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    put_vector(w, body + FORCE, cx, cy, cz)
    ux, uy, uz = times_symmetric(w, inertia + 4, ox, oy, oz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    put_vector(w, body + MOMENT, cx, cy, cz)
    for k in range(6):
        put(w, body + INERTIA + k, get(w, inertia + 4 + k))
    put_vector(w, body + COUPLING, zero, -hz, hy)
    put_vector(w, body + COUPLING + 3, hz, zero, -hx)
    put_vector(w, body + COUPLING + 6, -hy, hx, zero)
    put_vector(w, body + MASS, m, zero, zero)
    put_vector(w, body + MASS + 3, m, zero, m)


@part
def _split_joint(w, body, tau, extra, turns):
    """Compute U = IA s, 1/D and u of the joint; `extra` is added to its inertia D."""
    if turns:
        n0, n1, n2 = (
            get(w, body + INERTIA + 2),
            get(w, body + INERTIA + 4),
            get(w, body + INERTIA + 5),
        )
        f0, f1, f2 = get_vector(w, body + COUPLING + 6)
        d, u = n2, tau - get(w, body + MOMENT + 2)
    else:
        n0, n1, n2 = (
            get(w, body + COUPLING + 2),
            get(w, body + COUPLING + 5),
            get(w, body + COUPLING + 8),
        )
        f0, f1, f2 = get(w, body + MASS + 2), get(w, body + MASS + 4), get(w, body + MASS + 5)
        d, u = f2, tau - get(w, body + FORCE + 2)
    put_vector(w, body + U_MOMENT, n0, n1, n2)
    put_vector(w, body + U_FORCE, f0, f1, f2)
    put(w, body + D_INVERSE, 1.0 / (d + extra))
    put(w, body + U, u)


@part
def rotate_symmetric(w, R, S):
    """Return R S R' of a symmetric matrix S."""
    ax, ay, az = times_symmetric(w, S, get(w, R), get(w, R + 1), get(w, R + 2))
    bx, by, bz = times_symmetric(w, S, get(w, R + 3), get(w, R + 4), get(w, R + 5))
    cx, cy, cz = times_symmetric(w, S, get(w, R + 6), get(w, R + 7), get(w, R + 8))
    xx, xy, xz = rotate(w, R, ax, ay, az)
    _, yy, yz = rotate(w, R, bx, by, bz)
    _, _, zz = rotate(w, R, cx, cy, cz)
    return xx, xy, xz, yy, yz, zz


@routine
def _release_joint(w, body):
    """Subtract the share that the joint does not transmit: IA - U U'/D, and the bias force."""
    n0, n1, n2 = get_vector(w, body + U_MOMENT)
    f0, f1, f2 = get_vector(w, body + U_FORCE)
    share = get(w, body + D_INVERSE)
    g0, g1, g2, e0, e1, e2 = n0 * share, n1 * share, n2 * share, f0 * share, f1 * share, f2 * share
    I, B, M = body + INERTIA, body + COUPLING, body + MASS
    add_vector(w, I, -n0 * g0, -n0 * g1, -n0 * g2)
    add_vector(w, I + 3, -n1 * g1, -n1 * g2, -n2 * g2)
    add_vector(w, B, -n0 * e0, -n0 * e1, -n0 * e2)
    add_vector(w, B + 3, -n1 * e0, -n1 * e1, -n1 * e2)
    add_vector(w, B + 6, -n2 * e0, -n2 * e1, -n2 * e2)
    add_vector(w, M, -f0 * e0, -f0 * e1, -f0 * e2)
    add_vector(w, M + 3, -f1 * e1, -f1 * e2, -f2 * e2)
    lx, ly, lz = get_vector(w, body + C_ALPHA)
    bx, by, bz = get_vector(w, body + C_ACCELERATION)
    ux, uy, uz = times_symmetric(w, I, lx, ly, lz)
    u = get(w, body + U) * share
    vx = get(w, B) * bx + get(w, B + 1) * by + get(w, B + 2) * bz
    vy = get(w, B + 3) * bx + get(w, B + 4) * by + get(w, B + 5) * bz
    vz = get(w, B + 6) * bx + get(w, B + 7) * by + get(w, B + 8) * bz
    add_vector(w, body + MOMENT, ux + vx + n0 * u, uy + vy + n1 * u, uz + vz + n2 * u)
    ux, uy, uz = times_symmetric(w, M, bx, by, bz)
    vx = get(w, B) * lx + get(w, B + 3) * ly + get(w, B + 6) * lz
    vy = get(w, B + 1) * lx + get(w, B + 4) * ly + get(w, B + 7) * lz
    vz = get(w, B + 2) * lx + get(w, B + 5) * ly + get(w, B + 8) * lz
    add_vector(w, body + FORCE, ux + vx + f0 * u, uy + vy + f1 * u, uz + vz + f2 * u)


@routine
def _carry_inertia(w, parent, body):
    """Add the articulated inertia of a body to that of its parent, about the parent's origin."""
    F = body + R
    B, px, py, pz = body + COUPLING, get(w, body + P), get(w, body + P + 1), get(w, body + P + 2)
    a, b, c, d, e, f = rotate_symmetric(w, F, body + MASS)
    add_vector(w, parent + MASS, a, b, c)
    add_vector(w, parent + MASS + 3, d, e, f)
    r0, r1, r2 = rotate(w, F, get(w, B), get(w, B + 1), get(w, B + 2))
    t0, t1, t2 = rotate(w, F, get(w, B + 3), get(w, B + 4), get(w, B + 5))
    u0, u1, u2 = rotate(w, F, get(w, B + 6), get(w, B + 7), get(w, B + 8))
    b00, b10, b20 = rotate(w, F, r0, t0, u0)
    b01, b11, b21 = rotate(w, F, r1, t1, u1)
    b02, b12, b22 = rotate(w, F, r2, t2, u2)
    m00, m10, m20 = cross(px, py, pz, a, b, c)
    m01, m11, m21 = cross(px, py, pz, b, d, e)
    m02, m12, m22 = cross(px, py, pz, c, e, f)
    c00, c01, c02 = b00 + m00, b01 + m01, b02 + m02
    c10, c11, c12 = b10 + m10, b11 + m11, b12 + m12
    c20, c21, c22 = b20 + m20, b21 + m21, b22 + m22
    add_vector(w, parent + COUPLING, c00, c01, c02)
    add_vector(w, parent + COUPLING + 3, c10, c11, c12)
    add_vector(w, parent + COUPLING + 6, c20, c21, c22)
    xx, xy, xz, yy, yz, zz = rotate_symmetric(w, F, body + INERTIA)
    g00, _, _ = cross(px, py, pz, b00, b01, b02)
    g01, g11, _ = cross(px, py, pz, b10, b11, b12)
    g02, g12, g22 = cross(px, py, pz, b20, b21, b22)
    h00, h01, h02 = cross(px, py, pz, c00, c01, c02)
    _, h11, h12 = cross(px, py, pz, c10, c11, c12)
    _, _, h22 = cross(px, py, pz, c20, c21, c22)
    add_vector(w, parent + INERTIA, xx + g00 + h00, xy + g01 + h01, xz + g02 + h02)
    add_vector(w, parent + INERTIA + 3, yy + g11 + h11, yz + g12 + h12, zz + g22 + h22)


@part
def _pass_bias(w, parent, body):
    """Add the bias force and moment of a body to its parent."""
    fx, fy, fz = get_vector(w, body + FORCE)
    nx, ny, nz = get_vector(w, body + MOMENT)
    fx, fy, fz = rotate(w, body + R, fx, fy, fz)
    nx, ny, nz = rotate(w, body + R, nx, ny, nz)
    px, py, pz = get_vector(w, body + P)
    dx, dy, dz = cross(px, py, pz, fx, fy, fz)
    add_vector(w, parent + FORCE, fx, fy, fz)
    add_vector(w, parent + MOMENT, nx + dx, ny + dy, nz + dz)


@part
def _accelerate_body(w, parent, body, a, turns):
    """Compute the acceleration a of the joint, and those of the body."""
    lx, ly, lz = get_vector(w, parent + ALPHA)
    px, py, pz = get_vector(w, body + P)
    dx, dy, dz = cross(lx, ly, lz, px, py, pz)
    bx, by, bz = get_vector(w, parent + ACCELERATION)
    bx, by, bz = rotate_back(w, body + R, bx + dx, by + dy, bz + dz)
    lx, ly, lz = rotate_back(w, body + R, lx, ly, lz)
    c0, c1, c2 = get_vector(w, body + C_ALPHA)
    lx, ly, lz = lx + c0, ly + c1, lz + c2
    c0, c1, c2 = get_vector(w, body + C_ACCELERATION)
    bx, by, bz = bx + c0, by + c1, bz + c2
    n0, n1, n2 = get_vector(w, body + U_MOMENT)
    f0, f1, f2 = get_vector(w, body + U_FORCE)
    known = n0 * lx + n1 * ly + n2 * lz + (f0 * bx + f1 * by + f2 * bz)
    result = (get(w, body + U) - known) * get(w, body + D_INVERSE)
    put(w, a, result)
    if turns:
        lz = lz + result
    else:
        bz = bz + result
    put_vector(w, body + ALPHA, lx, ly, lz)
    put_vector(w, body + ACCELERATION, bx, by, bz)


@stage
def compute_joint_accelerations(
    w,
    step,
    each=(
        "each: parent=62; body=62; inertia=10; v=row; tau=row; extra=row; a=row; turns=whole; "
        "carried=whole"
    ),
):
    """Compute the accelerations a of joints under torques tau at velocities v.

    `extra` is added to the inertia at each joint: the inertia of its motor, and damping times the
    step of an implicit integration. The bodies come after their parents. `carried` is true if the
    parent is a carrier, which feels no reaction.
    """
    align_stack()
    for i in range(each[0]):
        k = 9 * i + 1
        _turn_body(w, each[k], each[k + 1], get(w, each[k + 3]), each[k + 7])
        _begin_articulated_body(w, each[k + 1], each[k + 2])
    for i in range(each[0] - 1, -1, -1):
        k = 9 * i + 1
        body = each[k + 1]
        _split_joint(w, body, get(w, each[k + 4]), get(w, each[k + 5]), each[k + 7])
        if not each[k + 8]:
            _release_joint(w, body)
            _carry_inertia(w, each[k], body)
            _pass_bias(w, each[k], body)
    for i in range(each[0]):
        k = 9 * i + 1
        _accelerate_body(w, each[k], each[k + 1], each[k + 6], each[k + 7])
