"""Articulated-body algorithm: the accelerations of joints under forces.

R. Featherstone, Rigid Body Dynamics Algorithms, 2008, section 7.3 and table 7.1.
"""

from robsim.kernels.dynamics.body_rows import (
    ACCELERATION,
    ACCELERATION_BIAS,
    AXIS_FORCE,
    AXIS_MOMENT,
    COMPLIANCE,
    COUPLING,
    EXCESS,
    FIRST_MOMENT,
    FORCE,
    IMPOSSIBLE,
    MASS,
    MASSES,
    MOMENT,
    MOMENTS,
    POSITION,
    RATE_BIAS,
    REVOLUTE,
    SECOND_MOMENT,
    TURNING,
    TURNING_RATE,
)
from robsim.kernels.formulas.lane_vectors import (
    add_to_vector,
    cross_product,
    get_vector,
    put_vector,
    rotate_symmetric,
    times_matrix,
    times_symmetric,
    times_transpose,
)
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import align_stack, get, put, where
from robsim.kernels.machine.stages import stage


@part
def _turn_body(w, parent, s, kind, v):
    """Compute the turning of a body, and the accelerations of the body by velocities."""
    ox, oy, oz = get_vector(w, parent + TURNING)
    px, py, pz = get_vector(w, s + POSITION)
    ux, uy, uz = cross_product(ox, oy, oz, px, py, pz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    cx, cy, cz = times_transpose(w, s, cx, cy, cz)
    ox, oy, oz = times_transpose(w, s, ox, oy, oz)
    speed = get(w, v)
    if kind == REVOLUTE:
        put_vector(w, s + RATE_BIAS, oy * speed, -(ox * speed), 0.0)
        oz = oz + speed
    else:
        put_vector(w, s + RATE_BIAS, 0.0, 0.0, 0.0)
        cx, cy = cx + 2.0 * oy * speed, cy - 2.0 * ox * speed
    put_vector(w, s + ACCELERATION_BIAS, cx, cy, cz)
    put_vector(w, s + TURNING, ox, oy, oz)


@part
def _start_articulated(w, s, inertia):
    """Write the inertia of a body, and its force and moment by velocities."""
    ox, oy, oz = get_vector(w, s + TURNING)
    m = get(w, inertia + MASS)
    hx, hy, hz = get_vector(w, inertia + FIRST_MOMENT)
    ux, uy, uz = cross_product(ox, oy, oz, hx, hy, hz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    put_vector(w, s + FORCE, cx, cy, cz)
    ux, uy, uz = times_symmetric(w, inertia + SECOND_MOMENT, ox, oy, oz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    put_vector(w, s + MOMENT, cx, cy, cz)
    for k in range(6):
        put(w, s + MOMENTS + k, get(w, inertia + SECOND_MOMENT + k))
    put_vector(w, s + COUPLING, 0.0, -hz, hy)
    put_vector(w, s + COUPLING + 3, hz, 0.0, -hx)
    put_vector(w, s + COUPLING + 6, -hy, hx, 0.0)
    put_vector(w, s + MASSES, m, 0.0, 0.0)
    put_vector(w, s + MASSES + 3, m, 0.0, m)


@part
def _release_joint(w, s, kind, tau, diagonal):
    """Write the articulated inertia along the axis of a joint, and the force beyond the bias."""
    if kind == REVOLUTE:
        nx, ny, nz = get(w, s + MOMENTS + 2), get(w, s + MOMENTS + 4), get(w, s + MOMENTS + 5)
        fx, fy, fz = get_vector(w, s + COUPLING + 6)
        d, bias = nz, get(w, s + MOMENT + 2)
    else:
        nx, ny, nz = get(w, s + COUPLING + 2), get(w, s + COUPLING + 5), get(w, s + COUPLING + 8)
        fx, fy, fz = get(w, s + MASSES + 2), get(w, s + MASSES + 4), get(w, s + MASSES + 5)
        d, bias = fz, get(w, s + FORCE + 2)
    if diagonal >= 0:
        d = d + get(w, diagonal)
    put_vector(w, s + AXIS_MOMENT, nx, ny, nz)
    put_vector(w, s + AXIS_FORCE, fx, fy, fz)
    put(w, s + COMPLIANCE, where(d > 0.0, 1.0 / d, IMPOSSIBLE))
    put(w, s + EXCESS, get(w, tau) - bias)


@part
def _project_inertia(w, s):
    """Subtract the inertia that the joint does not transmit: I - U U'/D."""
    share = get(w, s + COMPLIANCE)
    n0, n1, n2 = get_vector(w, s + AXIS_MOMENT)
    f0, f1, f2 = get_vector(w, s + AXIS_FORCE)
    g0, g1, g2 = n0 * share, n1 * share, n2 * share
    e0, e1, e2 = f0 * share, f1 * share, f2 * share
    add_to_vector(w, s + MOMENTS, -(n0 * g0), -(n0 * g1), -(n0 * g2))
    add_to_vector(w, s + MOMENTS + 3, -(n1 * g1), -(n1 * g2), -(n2 * g2))
    add_to_vector(w, s + COUPLING, -(n0 * e0), -(n0 * e1), -(n0 * e2))
    add_to_vector(w, s + COUPLING + 3, -(n1 * e0), -(n1 * e1), -(n1 * e2))
    add_to_vector(w, s + COUPLING + 6, -(n2 * e0), -(n2 * e1), -(n2 * e2))
    add_to_vector(w, s + MASSES, -(f0 * e0), -(f0 * e1), -(f0 * e2))
    add_to_vector(w, s + MASSES + 3, -(f1 * e1), -(f1 * e2), -(f2 * e2))


@part
def _pass_bias(w, s, parent):
    """Add the bias force of a body and its joint to its parent: p + I c + U u/D."""
    lx, ly, lz = get_vector(w, s + RATE_BIAS)
    bx, by, bz = get_vector(w, s + ACCELERATION_BIAS)
    t = get(w, s + EXCESS) * get(w, s + COMPLIANCE)
    n0, n1, n2 = get_vector(w, s + AXIS_MOMENT)
    f0, f1, f2 = get_vector(w, s + AXIS_FORCE)
    ax, ay, az = times_symmetric(w, s + MOMENTS, lx, ly, lz)
    cx, cy, cz = times_matrix(w, s + COUPLING, bx, by, bz)
    px, py, pz = get_vector(w, s + MOMENT)
    x0, x1, x2 = px + ax + cx + n0 * t, py + ay + cy + n1 * t, pz + az + cz + n2 * t
    ax, ay, az = times_transpose(w, s + COUPLING, lx, ly, lz)
    cx, cy, cz = times_symmetric(w, s + MASSES, bx, by, bz)
    px, py, pz = get_vector(w, s + FORCE)
    y0, y1, y2 = px + ax + cx + f0 * t, py + ay + cy + f1 * t, pz + az + cz + f2 * t
    px, py, pz = get_vector(w, s + POSITION)
    fx, fy, fz = times_matrix(w, s, y0, y1, y2)
    nx, ny, nz = times_matrix(w, s, x0, x1, x2)
    dx, dy, dz = cross_product(px, py, pz, fx, fy, fz)
    add_to_vector(w, parent + FORCE, fx, fy, fz)
    add_to_vector(w, parent + MOMENT, nx + dx, ny + dy, nz + dz)


@part
def _pass_inertia(w, s, parent):
    """Add the articulated inertia of a body to its parent.

    With the rotation R and the skew-symmetric matrix P of the position, M' = R M R',
    B' = R B R' + P M', and I' = R I R' + P (R B R')' - B' P.
    """
    px, py, pz = get_vector(w, s + POSITION)
    a, b, c, d, e, f = rotate_symmetric(w, s, s + MASSES)
    add_to_vector(w, parent + MASSES, a, b, c)
    add_to_vector(w, parent + MASSES + 3, d, e, f)
    x, y, z = get_vector(w, s + COUPLING)
    r0, r1, r2 = times_matrix(w, s, x, y, z)
    x, y, z = get_vector(w, s + COUPLING + 3)
    t0, t1, t2 = times_matrix(w, s, x, y, z)
    x, y, z = get_vector(w, s + COUPLING + 6)
    u0, u1, u2 = times_matrix(w, s, x, y, z)
    b00, b10, b20 = times_matrix(w, s, r0, t0, u0)
    b01, b11, b21 = times_matrix(w, s, r1, t1, u1)
    b02, b12, b22 = times_matrix(w, s, r2, t2, u2)
    m00, m10, m20 = cross_product(px, py, pz, a, b, c)
    m01, m11, m21 = cross_product(px, py, pz, b, d, e)
    m02, m12, m22 = cross_product(px, py, pz, c, e, f)
    c00, c01, c02 = b00 + m00, b01 + m01, b02 + m02
    c10, c11, c12 = b10 + m10, b11 + m11, b12 + m12
    c20, c21, c22 = b20 + m20, b21 + m21, b22 + m22
    add_to_vector(w, parent + COUPLING, c00, c01, c02)
    add_to_vector(w, parent + COUPLING + 3, c10, c11, c12)
    add_to_vector(w, parent + COUPLING + 6, c20, c21, c22)
    xx, xy, xz, yy, yz, zz = rotate_symmetric(w, s, s + MOMENTS)
    g00, _, _ = cross_product(px, py, pz, b00, b01, b02)
    g01, g11, _ = cross_product(px, py, pz, b10, b11, b12)
    g02, g12, g22 = cross_product(px, py, pz, b20, b21, b22)
    h00, h01, h02 = cross_product(px, py, pz, c00, c01, c02)
    _, h11, h12 = cross_product(px, py, pz, c10, c11, c12)
    _, _, h22 = cross_product(px, py, pz, c20, c21, c22)
    add_to_vector(w, parent + MOMENTS, xx + g00 + h00, xy + g01 + h01, xz + g02 + h02)
    add_to_vector(w, parent + MOMENTS + 3, yy + g11 + h11, yz + g12 + h12, zz + g22 + h22)


@part
def _accelerate_body(w, parent, s, kind, a):
    """Compute the acceleration of a joint, and the accelerations of its body."""
    lx, ly, lz = get_vector(w, parent + TURNING_RATE)
    px, py, pz = get_vector(w, s + POSITION)
    dx, dy, dz = cross_product(lx, ly, lz, px, py, pz)
    bx, by, bz = get_vector(w, parent + ACCELERATION)
    bx, by, bz = times_transpose(w, s, bx + dx, by + dy, bz + dz)
    lx, ly, lz = times_transpose(w, s, lx, ly, lz)
    cx, cy, cz = get_vector(w, s + RATE_BIAS)
    lx, ly, lz = lx + cx, ly + cy, lz + cz
    cx, cy, cz = get_vector(w, s + ACCELERATION_BIAS)
    bx, by, bz = bx + cx, by + cy, bz + cz
    nx, ny, nz = get_vector(w, s + AXIS_MOMENT)
    fx, fy, fz = get_vector(w, s + AXIS_FORCE)
    carried = (nx * lx + ny * ly + nz * lz) + (fx * bx + fy * by + fz * bz)
    acceleration = (get(w, s + EXCESS) - carried) * get(w, s + COMPLIANCE)
    put(w, a, acceleration)
    if kind == REVOLUTE:
        lz = lz + acceleration
    else:
        bz = bz + acceleration
    put_vector(w, s + TURNING_RATE, lx, ly, lz)
    put_vector(w, s + ACCELERATION, bx, by, bz)


@stage
def accelerate_joints(
    w,
    step,
    each="each: kind=whole; loads=whole; parent=62; body=62; inertia=10; v=row; tau=row; "
    "diagonal=row or none; a=row",
):
    """Compute the accelerations a of joints under the forces tau, at velocities v.

    The rows `diagonal` are added to the inertia at each joint: the armature, and with implicit
    integration the slopes of forces times the step. The bodies are placed in their parents, and
    come after them. `loads` is 1 if the parent is a body on a joint. If an articulated inertia is
    not positive, accelerations are `IMPOSSIBLE` or infinite.
    """
    align_stack()
    n = each[0]
    for i in range(n):
        at = 9 * i
        _turn_body(w, each[at + 3], each[at + 4], each[at + 1], each[at + 6])
        _start_articulated(w, each[at + 4], each[at + 5])
    for i in range(n - 1, -1, -1):
        at = 9 * i
        parent, s = each[at + 3], each[at + 4]
        _release_joint(w, s, each[at + 1], each[at + 7], each[at + 8])
        if each[at + 2]:
            _project_inertia(w, s)
            _pass_bias(w, s, parent)
            _pass_inertia(w, s, parent)
    for i in range(n):
        at = 9 * i
        _accelerate_body(w, each[at + 3], each[at + 4], each[at + 1], each[at + 9])
