"""Recursive Newton-Euler algorithm: the forces at joints that a motion needs.

J. Y. S. Luh, M. W. Walker and R. P. C. Paul, On-line computational scheme for mechanical
manipulators, J. Dynamic Systems, Measurement, and Control 102, 1980; R. Featherstone, Rigid Body
Dynamics Algorithms, 2008, table 5.1.
"""

from robsim.kernels.dynamics.body_rows import (
    ACCELERATION,
    FIRST_MOMENT,
    FORCE,
    MASS,
    MOMENT,
    POSITION,
    PRISMATIC,
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
    times_matrix,
    times_symmetric,
    times_transpose,
)
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import align_stack, get, put
from robsim.kernels.machine.stages import stage


@part
def _move_body(w, parent, s, kind, v, a):
    """Compute the motion of a body on a joint from the motion of its parent."""
    ox, oy, oz = get_vector(w, parent + TURNING)
    lx, ly, lz = get_vector(w, parent + TURNING_RATE)
    px, py, pz = get_vector(w, s + POSITION)
    bx, by, bz = get_vector(w, parent + ACCELERATION)
    ux, uy, uz = cross_product(ox, oy, oz, px, py, pz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    dx, dy, dz = cross_product(lx, ly, lz, px, py, pz)
    bx, by, bz = times_transpose(w, s, bx + dx + cx, by + dy + cy, bz + dz + cz)
    ox, oy, oz = times_transpose(w, s, ox, oy, oz)
    lx, ly, lz = times_transpose(w, s, lx, ly, lz)
    if v >= 0:
        if kind == REVOLUTE:
            speed = get(w, v)
            lx, ly, oz = lx + oy * speed, ly - ox * speed, oz + speed
        elif kind == PRISMATIC:
            speed = get(w, v)
            bx, by = bx + 2.0 * oy * speed, by - 2.0 * ox * speed
        else:  # the velocity is relative to the parent, in the axes of the body
            vx, vy, vz = get_vector(w, v)
            rx, ry, rz = get_vector(w, v + 3)
            cx, cy, cz = cross_product(ox, oy, oz, vx, vy, vz)
            dx, dy, dz = cross_product(rx, ry, rz, vx, vy, vz)
            bx, by, bz = bx + 2.0 * cx + dx, by + 2.0 * cy + dy, bz + 2.0 * cz + dz
            cx, cy, cz = cross_product(ox, oy, oz, rx, ry, rz)
            lx, ly, lz = lx + cx, ly + cy, lz + cz
            ox, oy, oz = ox + rx, oy + ry, oz + rz
    if a >= 0:
        if kind == REVOLUTE:
            lz = lz + get(w, a)
        elif kind == PRISMATIC:
            bz = bz + get(w, a)
        else:
            bx, by, bz = bx + get(w, a), by + get(w, a + 1), bz + get(w, a + 2)
            lx, ly, lz = lx + get(w, a + 3), ly + get(w, a + 4), lz + get(w, a + 5)
    put_vector(w, s + TURNING, ox, oy, oz)
    put_vector(w, s + TURNING_RATE, lx, ly, lz)
    put_vector(w, s + ACCELERATION, bx, by, bz)


@part
def _balance_body(w, s, inertia):
    """Compute the force and the moment that the motion of a body needs (Newton and Euler)."""
    ox, oy, oz = get_vector(w, s + TURNING)
    lx, ly, lz = get_vector(w, s + TURNING_RATE)
    bx, by, bz = get_vector(w, s + ACCELERATION)
    m = get(w, inertia + MASS)
    hx, hy, hz = get_vector(w, inertia + FIRST_MOMENT)
    ux, uy, uz = cross_product(ox, oy, oz, hx, hy, hz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    dx, dy, dz = cross_product(lx, ly, lz, hx, hy, hz)
    put_vector(w, s + FORCE, m * bx + dx + cx, m * by + dy + cy, m * bz + dz + cz)
    ux, uy, uz = times_symmetric(w, inertia + SECOND_MOMENT, ox, oy, oz)
    cx, cy, cz = cross_product(ox, oy, oz, ux, uy, uz)
    ux, uy, uz = times_symmetric(w, inertia + SECOND_MOMENT, lx, ly, lz)
    dx, dy, dz = cross_product(hx, hy, hz, bx, by, bz)
    put_vector(w, s + MOMENT, ux + cx + dx, uy + cy + dy, uz + cz + dz)


@part
def _pass_force(w, s, parent):
    """Add the force on a body to the force on its parent."""
    fx, fy, fz = get_vector(w, s + FORCE)
    nx, ny, nz = get_vector(w, s + MOMENT)
    px, py, pz = get_vector(w, s + POSITION)
    fx, fy, fz = times_matrix(w, s, fx, fy, fz)
    nx, ny, nz = times_matrix(w, s, nx, ny, nz)
    dx, dy, dz = cross_product(px, py, pz, fx, fy, fz)
    add_to_vector(w, parent + FORCE, fx, fy, fz)
    add_to_vector(w, parent + MOMENT, nx + dx, ny + dy, nz + dz)


@part
def _write_force(w, s, kind, tau):
    """Write the force of the joint of a body, of the force and the moment on the body."""
    if kind == REVOLUTE:
        put(w, tau, get(w, s + MOMENT + 2))
    elif kind == PRISMATIC:
        put(w, tau, get(w, s + FORCE + 2))
    else:
        for k in range(6):
            put(w, tau + k, get(w, s + FORCE + k))


@part
def _weigh_body(w, parent, s, inertia):
    """Compute the force and the moment that carry a body at rest."""
    bx, by, bz = get_vector(w, parent + ACCELERATION)
    bx, by, bz = times_transpose(w, s, bx, by, bz)
    m = get(w, inertia + MASS)
    hx, hy, hz = get_vector(w, inertia + FIRST_MOMENT)
    nx, ny, nz = cross_product(hx, hy, hz, bx, by, bz)
    put_vector(w, s + ACCELERATION, bx, by, bz)
    put_vector(w, s + FORCE, m * bx, m * by, m * bz)
    put_vector(w, s + MOMENT, nx, ny, nz)


@stage
def compute_gravity_forces(
    w, step, each="each: kind=whole; loads=whole; parent=62; body=62; inertia=10; tau=row"
):
    """Compute the forces tau that hold joints at rest on carriers at rest.

    The parameters are described in `compute_joint_forces`.
    """
    n = each[0]
    for i in range(n):
        at = 6 * i
        _weigh_body(w, each[at + 3], each[at + 4], each[at + 5])
    for i in range(n - 1, -1, -1):
        at = 6 * i
        _write_force(w, each[at + 4], each[at + 1], each[at + 6])
        if each[at + 2]:
            _pass_force(w, each[at + 4], each[at + 3])


@stage
def compute_joint_forces(
    w,
    step,
    each="each: kind=whole; loads=whole; parent=62; body=62; inertia=10; v=row or none; "
    "a=row or none; tau=row",
):
    """Compute the forces tau at joints for velocities v and accelerations a.

    The bodies are placed in their parents, and come after them. `loads` is 1 if the parent is a
    body on a joint. A floating joint has six consecutive rows of v, a and tau.
    """
    align_stack()
    n = each[0]
    for i in range(n):
        at = 8 * i
        s = each[at + 4]
        _move_body(w, each[at + 3], s, each[at + 1], each[at + 6], each[at + 7])
        _balance_body(w, s, each[at + 5])
    for i in range(n - 1, -1, -1):
        at = 8 * i
        _write_force(w, each[at + 4], each[at + 1], each[at + 8])
        if each[at + 2]:
            _pass_force(w, each[at + 4], each[at + 3])
