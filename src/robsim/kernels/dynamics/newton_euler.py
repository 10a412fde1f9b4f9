"""Recursive Newton-Euler algorithm: joint torques from accelerations."""

from robsim.kernels.dynamics.body_motion import ACCELERATION, ALPHA, FORCE, MOMENT, OMEGA, P, R
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
from robsim.kernels.machine.stages import stage


@part
def _move_body(w, parent, body, v, a, turns):
    """Compute angular velocity and acceleration, and the acceleration of the origin."""
    ox, oy, oz = get_vector(w, parent + OMEGA)
    lx, ly, lz = get_vector(w, parent + ALPHA)
    px, py, pz = get_vector(w, body + P)
    ux, uy, uz = cross(ox, oy, oz, px, py, pz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    dx, dy, dz = cross(lx, ly, lz, px, py, pz)
    bx, by, bz = get_vector(w, parent + ACCELERATION)
    bx, by, bz = rotate_back(w, body + R, bx + dx + cx, by + dy + cy, bz + dz + cz)
    ox, oy, oz = rotate_back(w, body + R, ox, oy, oz)
    lx, ly, lz = rotate_back(w, body + R, lx, ly, lz)
    if turns:
        lx, ly, lz = lx + oy * v, ly - ox * v, lz + a
        oz = oz + v
    else:
        bx, by, bz = bx + 2.0 * oy * v, by - 2.0 * ox * v, bz + a
    put_vector(w, body + OMEGA, ox, oy, oz)
    put_vector(w, body + ALPHA, lx, ly, lz)
    put_vector(w, body + ACCELERATION, bx, by, bz)


@part
def _load_body(w, body, inertia):
    """Compute the force and the moment about the origin that give a body its acceleration."""
    m = get(w, inertia)
    hx, hy, hz = get_vector(w, inertia + 1)
    ox, oy, oz = get_vector(w, body + OMEGA)
    lx, ly, lz = get_vector(w, body + ALPHA)
    bx, by, bz = get_vector(w, body + ACCELERATION)
    ux, uy, uz = cross(ox, oy, oz, hx, hy, hz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    dx, dy, dz = cross(lx, ly, lz, hx, hy, hz)
    put_vector(w, body + FORCE, m * bx + dx + cx, m * by + dy + cy, m * bz + dz + cz)
    ux, uy, uz = times_symmetric(w, inertia + 4, ox, oy, oz)
    cx, cy, cz = cross(ox, oy, oz, ux, uy, uz)
    ux, uy, uz = times_symmetric(w, inertia + 4, lx, ly, lz)
    dx, dy, dz = cross(hx, hy, hz, bx, by, bz)
    put_vector(w, body + MOMENT, ux + cx + dx, uy + cy + dy, uz + cz + dz)


@part
def _pass_force(w, parent, body):
    """Add the force and the moment on a body to its parent."""
    fx, fy, fz = get_vector(w, body + FORCE)
    nx, ny, nz = get_vector(w, body + MOMENT)
    fx, fy, fz = rotate(w, body + R, fx, fy, fz)
    nx, ny, nz = rotate(w, body + R, nx, ny, nz)
    px, py, pz = get_vector(w, body + P)
    dx, dy, dz = cross(px, py, pz, fx, fy, fz)
    add_vector(w, parent + FORCE, fx, fy, fz)
    add_vector(w, parent + MOMENT, nx + dx, ny + dy, nz + dz)


BODY_ROWS = (
    "each: parent=62; body=62; inertia=10; v=row; a=row; tau=row; turns=whole; carried=whole"
)


@stage
def compute_joint_torques(w, step, each=BODY_ROWS):
    """Compute the torques tau that give the joints accelerations a at velocities v.

    The bodies come after their parents. `carried` is true if the parent is a carrier, which feels
    no reaction. (Luh, Walker and Paul 1980; Featherstone 2008, table 5.1, in body axes with
    classical accelerations.)
    """
    align_stack()
    for i in range(each[0]):
        k = 8 * i + 1
        _move_body(w, each[k], each[k + 1], get(w, each[k + 3]), get(w, each[k + 4]), each[k + 6])
        _load_body(w, each[k + 1], each[k + 2])
    for i in range(each[0] - 1, -1, -1):
        k = 8 * i + 1
        body = each[k + 1]
        put(w, each[k + 5], get(w, body + (MOMENT + 2 if each[k + 6] else FORCE + 2)))
        if not each[k + 7]:
            _pass_force(w, each[k], body)
