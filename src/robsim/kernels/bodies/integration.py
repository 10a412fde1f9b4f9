"""Stages that integrate coordinates exactly for velocities that are constant over a period."""

from robsim.kernels.formulas import se3, vehicle_motion
from robsim.kernels.formulas.lane_math import cos_sin
from robsim.kernels.machine.array_views import vector
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, any_lane, get, put, sqrt, where
from robsim.kernels.machine.stages import stage


@stage
def integrate_coordinates(w, step, dt="row", moves="each: q=row; v=row"):
    """Replace each coordinate q by q + dt v."""
    dt = get(w, dt)
    for i in range(moves[0]):
        q, v = moves[1 + 2 * i], moves[2 + 2 * i]
        put(w, q, get(w, q) + dt * get(w, v))


@part
def screw_coefficients(theta):
    """Return b and c of `along_screw`, sin(theta/2)/(theta/2), and cos(theta/2)."""
    half, turns = 0.5 * theta, theta > 0.0
    cosine, sine = cos_sin(half)
    sinc = where(turns, sine / where(turns, half, 1.0), 1.0)
    c, far = se3.cubic_coefficient(theta), theta > 1.0
    if any_lane(far):
        _, whole = cos_sin(theta)
        c = where(far, (theta - whole) / (theta * theta * theta), c)
    return 0.5 * sinc * sinc, c, sinc, cosine


@stage
def integrate_floating_body(w, step, dt="row", q="7", v="6"):
    """Replace the pose T of a floating body, in coordinates q, by T exp(V dt) for its twist V."""
    dt = get(w, dt)
    vx, vy, vz = dt * get(w, v), dt * get(w, v + 1), dt * get(w, v + 2)
    wx, wy, wz = dt * get(w, v + 3), dt * get(w, v + 4), dt * get(w, v + 5)
    b, c, sinc, cosine = screw_coefficients(sqrt(wx * wx + wy * wy + wz * wz))
    shift = se3.along_screw(vx, vy, vz, wx, wy, wz, b, c)
    x, y, z, u = get(w, q + 3), get(w, q + 4), get(w, q + 5), get(w, q + 6)
    R, s = se3.quaternion_to_rotation(x, y, z, u), 0.5 * sinc
    for r in range(3):
        along = R[r][0] * shift[0] + R[r][1] * shift[1] + R[r][2] * shift[2]
        put(w, q + r, get(w, q + r) + along)
    x, y, z, u = se3.quaternion_product(x, y, z, u, s * wx, s * wy, s * wz, cosine)
    norm = sqrt(x * x + y * y + z * z + u * u)
    put(w, q + 3, x / norm)
    put(w, q + 4, y / norm)
    put(w, q + 5, z / norm)
    put(w, q + 6, u / norm)


@stage
def integrate_planar_body(w, step, dt="row", q="3", v="velocities", velocities="count"):
    """Integrate the coordinates q = (x, y, theta) of a body that moves in a plane.

    The rows v hold (vx, vy, omega), or (v, omega). theta is not wrapped.
    """
    dt, theta, vx, omega = get(w, dt), get(w, q + 2), get(w, v), get(w, v + velocities - 1)
    vy = get(w, v + 1) if velocities == 3 else 0.0 * vx
    x, y = vehicle_motion.chord_in_plane(theta, vx, vy, omega, dt)
    put(w, q, get(w, q) + x)
    put(w, q + 1, get(w, q + 1) + y)
    put(w, q + 2, theta + dt * omega)


@stage
def steer_car(w, step, dt="row", angle="row", v="2", car="3"):
    """Turn the steering angle of a car towards the angle of its commanded velocity.

    The rows v hold v and omega, the rows car the wheelbase and the limit and rate of the angle.
    """
    angle, v, car = vector(w, angle, 1), vector(w, v, 2), car * WIDTH
    for b in range(WIDTH):
        numbers = w[car + b], w[car + WIDTH + b], w[car + 2 * WIDTH + b], w[dt * WIDTH + b]
        vehicle_motion.turn_steering_angle(0, 0, *numbers, angle[:, b : b + 1], v[:, b : b + 1])


@stage
def apply_steering_angle(w, step, angle="row", v="2", wheelbase="row"):
    """Replace omega of a car by the yaw rate of its steering angle. The rows v hold v and omega."""
    angle, v = vector(w, angle, 1), vector(w, v, 2)
    for b in range(WIDTH):
        vehicle_motion.set_yaw_rate(
            0, 0, w[wheelbase * WIDTH + b], angle[:, b : b + 1], v[:, b : b + 1]
        )


@stage
def roll_wheel(w, step, dt="row", angle="row", v="2", ratio="2"):
    """Integrate the angle of a rolling wheel. The rows v hold v and omega of the vehicle."""
    speed = get(w, ratio) * get(w, v) + get(w, ratio + 1) * get(w, v + 1)
    put(w, angle, get(w, angle) + get(w, dt) * speed)


@stage
def assemble_velocities(w, step, n="count", v="n", prescribed="n", commands="each: row or none"):
    """Collect the velocities v from the commands, or from `prescribed` if a command is -1."""
    for i in range(n):
        command = commands[1 + i]
        put(w, v + i, get(w, command if command >= 0 else prescribed + i))
