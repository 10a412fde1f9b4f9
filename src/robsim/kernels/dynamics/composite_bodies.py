"""Composite-rigid-body algorithm: the mass matrix, and its factors.

M. W. Walker and D. E. Orin, Efficient dynamic computer simulation of robotic mechanisms, J. Dynamic
Systems, Measurement, and Control 104, 1982; R. Featherstone, Rigid Body Dynamics Algorithms, 2008,
table 6.2 and section 6.5.
"""

from robsim.kernels.dynamics.body_rows import (
    FLOATING,
    IMPOSSIBLE,
    MASS,
    MOMENTS,
    POSITION,
    REVOLUTE,
    SECOND_MOMENT,
)
from robsim.kernels.formulas.lane_vectors import (
    add_to_vector,
    cross_product,
    get_vector,
    rotate_symmetric,
    times_matrix,
    times_symmetric,
)
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import align_stack, get, put, where
from robsim.kernels.machine.stages import stage

# rows of a composite inertia: moments, first moment and mass
COMPOSITE, COMPOSITE_FIRST, COMPOSITE_MASS = MOMENTS, MOMENTS + 6, MOMENTS + 9
FIELDS = 6  # of a record of a body


@part
def _merge_composite(w, s, parent):
    """Add the composite inertia of a body to its parent, by the parallel axis theorem."""
    m = get(w, s + COMPOSITE_MASS)
    hx, hy, hz = get_vector(w, s + COMPOSITE_FIRST)
    px, py, pz = get_vector(w, s + POSITION)
    rx, ry, rz = times_matrix(w, s, hx, hy, hz)
    add_to_vector(w, parent + COMPOSITE_FIRST, rx + m * px, ry + m * py, rz + m * pz)
    put(w, parent + COMPOSITE_MASS, get(w, parent + COMPOSITE_MASS) + m)
    xx, xy, xz, yy, yz, zz = rotate_symmetric(w, s, s + COMPOSITE)
    qx, qy, qz = 2.0 * rx + m * px, 2.0 * ry + m * py, 2.0 * rz + m * pz
    t = px * qx + py * qy + pz * qz
    ex, ey = rx + m * px, ry + m * py
    xy, xz = xy - (px * ry + ex * py), xz - (px * rz + ex * pz)
    yz = yz - (py * rz + ey * pz)
    add_to_vector(w, parent + COMPOSITE, xx + t - px * qx, xy, xz)
    add_to_vector(w, parent + COMPOSITE + 3, yy + t - py * qy, yz, zz + t - pz * qz)


@part
def _start_unit_force(w, s, turns, k):
    """Return the force and moment that a unit acceleration along or about an axis k needs."""
    m = get(w, s + COMPOSITE_MASS)
    hx, hy, hz = get_vector(w, s + COMPOSITE_FIRST)
    zero = 0.0 * m
    x, y, z = zero, zero, zero + 1.0
    if k == 0:
        x, z = z, zero
    elif k == 1:
        y, z = z, zero
    if turns:
        fx, fy, fz = cross_product(x, y, z, hx, hy, hz)
        nx, ny, nz = times_symmetric(w, s + COMPOSITE, x, y, z)
    else:
        fx, fy, fz = m * x, m * y, m * z
        nx, ny, nz = cross_product(hx, hy, hz, x, y, z)
    return fx, fy, fz, nx, ny, nz


@part
def _write_floating(w, H, n, row, column, force):
    """Write the entries of a force and moment at the six columns of a floating joint."""
    for k in range(6):
        put(w, H + row * n + column + k, force[k])
        put(w, H + (column + k) * n + row, force[k])


@part
def _write_row(w, each, i, row, H, n, force):
    """Write the entries of H of a unit force on body i, and carry the force to the root."""
    fx, fy, fz, nx, ny, nz = force
    at = 1 + FIELDS * i
    while True:
        kind, column, s = each[at], each[at + 2], each[at + 3]
        if kind == FLOATING:
            _write_floating(w, H, n, row, column, (fx, fy, fz, nx, ny, nz))
        else:
            entry = fz
            if kind == REVOLUTE:
                entry = nz
            put(w, H + row * n + column, entry)
            put(w, H + column * n + row, entry)
        if each[at + 1] < 0:
            break
        fx, fy, fz = times_matrix(w, s, fx, fy, fz)
        nx, ny, nz = times_matrix(w, s, nx, ny, nz)
        px, py, pz = get_vector(w, s + POSITION)
        dx, dy, dz = cross_product(px, py, pz, fx, fy, fz)
        nx, ny, nz = nx + dx, ny + dy, nz + dz
        at = 1 + FIELDS * each[at + 1]


@stage
def compute_mass_matrix(
    w,
    step,
    n="count",
    H="n, n",
    each="each: kind=whole; above=whole; column=whole; body=62; parent=62; inertia=10",
):
    """Compute the mass matrix H of bodies on joints.

    The bodies are placed in their parents, and come after them. `above` is the index of the parent
    in this list, or -1 if the parent is a carrier.
    """
    align_stack()
    for k in range(n * n):
        put(w, H + k, 0.0)
    for i in range(each[0]):
        s, inertia = each[4 + FIELDS * i], each[6 + FIELDS * i]
        for k in range(6):
            put(w, s + COMPOSITE + k, get(w, inertia + SECOND_MOMENT + k))
        for k in range(3):
            put(w, s + COMPOSITE_FIRST + k, get(w, inertia + 1 + k))
        put(w, s + COMPOSITE_MASS, get(w, inertia + MASS))
    for i in range(each[0] - 1, -1, -1):
        at = 1 + FIELDS * i
        kind, s = each[at], each[at + 3]
        if each[at + 1] >= 0:
            _merge_composite(w, s, each[at + 4])
        row = each[at + 2]
        for axis in range(6 if kind == FLOATING else 1):
            turns = kind == REVOLUTE or axis >= 3
            k = axis % 3 if kind == FLOATING else 2
            _write_row(w, each, i, row + axis, H, n, _start_unit_force(w, s, turns, k))


@stage
def compute_potential_energy(
    w, step, gravity="3", energy="row", each="each: loads=whole; parent=62; body=62; inertia=10"
):
    """Compute the potential energy -g' sum(m c) of bodies on joints, zero at their carrier.

    The carrier does not turn. The bodies are placed in their parents, and come after them. `loads`
    is 1 if the parent is a body on a joint.
    """
    total = 0.0 * get(w, gravity)
    for i in range(each[0]):
        s, inertia = each[4 * i + 3], each[4 * i + 4]
        put(w, s + COMPOSITE_MASS, get(w, inertia + MASS))
        for k in range(3):
            put(w, s + COMPOSITE_FIRST + k, get(w, inertia + 1 + k))
    for i in range(each[0] - 1, -1, -1):
        parent, s = each[4 * i + 2], each[4 * i + 3]
        m = get(w, s + COMPOSITE_MASS)
        hx, hy, hz = get_vector(w, s + COMPOSITE_FIRST)
        px, py, pz = get_vector(w, s + POSITION)
        rx, ry, rz = times_matrix(w, s, hx, hy, hz)
        rx, ry, rz = rx + m * px, ry + m * py, rz + m * pz
        if each[4 * i + 1]:
            add_to_vector(w, parent + COMPOSITE_FIRST, rx, ry, rz)
            put(w, parent + COMPOSITE_MASS, get(w, parent + COMPOSITE_MASS) + m)
        else:
            gx, gy, gz = get_vector(w, gravity)
            total = total - (gx * rx + gy * ry + gz * rz)
    put(w, energy, total)


@stage
def compute_kinetic_energy(w, step, n="count", H="n, n", armature="n", v="n", energy="row"):
    """Compute the kinetic energy v' (H + diag(armature)) v / 2."""
    total = 0.0 * get(w, v)
    for i in range(n):
        y = get(w, armature + i) * get(w, v + i)
        for j in range(n):
            y = y + get(w, H + i * n + j) * get(w, v + j)
        total = total + y * get(w, v + i)
    put(w, energy, 0.5 * total)


@stage
def add_to_diagonal(w, step, n="count", diagonal="n", H="n, n"):
    """Add numbers to the diagonal of a matrix."""
    for i in range(n):
        put(w, H + i * (n + 1), get(w, H + i * (n + 1)) + get(w, diagonal + i))


@stage
def merge_mimicking_joints(
    w, step, m="count", n="count", bodies="m, m", H="n, n", each="each: ratio=row; column=whole"
):
    """Compute the mass matrix H = G' M G of independent velocities from the matrix M of bodies.

    Row i of G is zero except for the ratio of entry i at its column.
    """
    for k in range(n * n):
        put(w, H + k, 0.0)
    for i in range(m):
        for j in range(m):
            at = H + each[2 * i + 2] * n + each[2 * j + 2]
            share = get(w, each[2 * i + 1]) * get(w, each[2 * j + 1])
            put(w, at, get(w, at) + share * get(w, bodies + i * m + j))


@stage
def solve_mass_matrix(
    w, step, n="count", H="n, n", L="n, n", tau="n", bias="n", diagonal="n or none", a="n"
):
    """Solve (H + diag(diagonal)) a = tau - bias by the factors L D L' of the matrix.

    L receives the factors. If the matrix is not positive, accelerations are `IMPOSSIBLE` or
    infinite.
    """
    for i in range(n):
        for j in range(i):
            x = get(w, H + i * n + j)
            for k in range(j):
                x = x - get(w, L + i * n + k) * get(w, L + j * n + k) * get(w, L + k * n + k)
            put(w, L + i * n + j, x / get(w, L + j * n + j))
        d = get(w, H + i * n + i)
        if diagonal >= 0:
            d = d + get(w, diagonal + i)
        for k in range(i):
            x = get(w, L + i * n + k)
            d = d - x * x * get(w, L + k * n + k)
        put(w, L + i * n + i, d)
        y = get(w, tau + i) - get(w, bias + i)
        for k in range(i):
            y = y - get(w, L + i * n + k) * get(w, a + k)
        put(w, a + i, y)
    for i in range(n - 1, -1, -1):
        d = get(w, L + i * n + i)
        y = where(d > 0.0, get(w, a + i) / d, IMPOSSIBLE)
        for k in range(i + 1, n):
            y = y - get(w, L + k * n + i) * get(w, a + k)
        put(w, a + i, y)
