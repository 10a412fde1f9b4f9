"""Stages of the motion of bodies: carriers, and bodies on revolute and prismatic joints.

A body has 68 rows of state in its own axes, with the offsets below. Accelerations are classical
accelerations of the origin minus gravity, which acts as an upward acceleration of the carriers.
"""

from robsim.kernels.dynamics.vector_lanes import get_vector, put_vector, rotate_back
from robsim.kernels.formulas.lane_math import cos_sin
from robsim.kernels.machine.lanes import align_stack, get, put
from robsim.kernels.machine.stages import stage

R, P = 0, 9  # rotation and position in the parent body
OMEGA, ALPHA, ACCELERATION = 12, 15, 18  # angular velocity and acceleration, and acceleration
FORCE, MOMENT = 21, 24  # on the body, or bias force and moment
INERTIA, COUPLING, MASS = 27, 33, 42  # articulated: moment and moment, moment and force, force
U_MOMENT, U_FORCE, D_INVERSE, U = 48, 51, 54, 55  # of the joint
C_ALPHA, C_ACCELERATION = 56, 59  # velocity products
BODY = 62


@stage
def place_joints(w, step, each="each: place=3, 4; x=row; body=62; turns=whole"):
    """Compute the poses of bodies in their parents, at coordinates x of their joints."""
    align_stack()
    for i in range(each[0]):
        place, x, body = each[4 * i + 1], get(w, each[4 * i + 2]), each[4 * i + 3]
        if each[4 * i + 4]:
            c, s = cos_sin(x)
            for r in range(3):
                a, b = get(w, place + 4 * r), get(w, place + 4 * r + 1)
                put(w, body + R + 3 * r, c * a + s * b)
                put(w, body + R + 3 * r + 1, c * b - s * a)
                put(w, body + R + 3 * r + 2, get(w, place + 4 * r + 2))
                put(w, body + P + r, get(w, place + 4 * r + 3))
        else:
            for r in range(3):
                for c in range(3):
                    put(w, body + R + 3 * r + c, get(w, place + 4 * r + c))
                along = get(w, place + 4 * r + 2) * x
                put(w, body + P + r, get(w, place + 4 * r + 3) + along)


@stage
def begin_carrier(w, step, rotation="9", omega="3", acceleration="3", gravity="3", body="62"):
    """Write the state of a carrier: gravity (world axes) turned into its axes, and its turning."""
    x, y, z = get_vector(w, gravity)
    gx, gy, gz = rotate_back(w, rotation, x, y, z)
    ax, ay, az = get_vector(w, acceleration)
    put_vector(w, body + ACCELERATION, ax - gx, ay - gy, az - gz)
    ox, oy, oz = get_vector(w, omega)
    put_vector(w, body + OMEGA, ox, oy, oz)
    zero = 0.0 * ox
    put_vector(w, body + ALPHA, zero, zero, zero)
