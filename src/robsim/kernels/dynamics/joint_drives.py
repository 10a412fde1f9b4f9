"""Stages of joints that torques move: servo loops, torque limits, friction and integration.

A period has several sub-steps of length h. In a sub-step the drives compute torques, friction
resists, the articulated-body algorithm gives the accelerations a, and semi-implicit Euler steps

    v+ = v + h a,    q+ = q + h v+

follow. Damping, and the slope of the drive's torque over the velocity, are implicit: with slopes d,
a solves (M + h diag(d)) a = torque - bias. A joint that rests (v = 0) is locked by its friction
until the torque that holds it exceeds the Coulomb torque, and a sliding joint stops where its
velocity changes its sign. Stops are exact, so that a resting joint does not creep.
"""

from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stages import stage

LOCK = 1e12  # inertia of a joint that friction holds, in kg m^2 or kg
FASTEST = 1e3  # speed of a joint above which a run counts as unstable, in rad/s or m/s


@stage
def servo_joints(
    w,
    step,
    n="count",
    command="n",
    v="n",
    gap="n",
    integral="n",
    gains="4, n",
    error="n",
    demand="n",
):
    """Compute the torques of a cascade of a position loop and a velocity loop.

    The error of the velocity loop is e = f u + c (r - q) - v, with the command u, the reference r
    of the position, whose rate is u, and the gap r - q. The torque is k e + i int(e). The rows of
    the gains are k, i, c and f.
    """
    for j in range(n):
        k, i = get(w, gains + j), get(w, gains + n + j)
        c, f = get(w, gains + 2 * n + j), get(w, gains + 3 * n + j)
        e = f * get(w, command + j) + c * get(w, gap + j) - get(w, v + j)
        put(w, error + j, e)
        put(w, demand + j, k * e + i * get(w, integral + j))


@stage
def add_torques(w, step, n="count", more="n", torque="n"):
    """Add torques to other torques."""
    for j in range(n):
        put(w, torque + j, get(w, torque + j) + get(w, more + j))


@stage
def accelerate_motors(w, step, n="count", armature="n", a="n", torque="n"):
    """Add the torques that accelerate the motors of joints."""
    for j in range(n):
        put(w, torque + j, get(w, torque + j) + get(w, armature + j) * get(w, a + j))


@stage
def damp_joints(w, step, n="count", damping="n", v="n", torque="n", slope="n"):
    """Subtract damping times velocity from torques; the damping is their slope."""
    for j in range(n):
        k = get(w, damping + j)
        put(w, torque + j, get(w, torque + j) - k * get(w, v + j))
        put(w, slope + j, k)


@stage
def feed_friction_forward(
    w, step, n="count", command="n", damping="n", friction="n", share="row", torque="n"
):
    """Add a share of the torques of friction at the commanded velocities."""
    factor = get(w, share)
    for j in range(n):
        u = get(w, command + j)
        sign = where(u > 0.0, 1.0 + 0.0 * u, where(u < 0.0, -1.0 + 0.0 * u, 0.0 * u))
        fed = get(w, damping + j) * u + get(w, friction + j) * sign
        put(w, torque + j, get(w, torque + j) + factor * fed)


@stage
def limit_torques(
    w, step, n="count", limits="n", torque="n", slope="n", share="row", saturation="n"
):
    """Limit torques, and add the `share` of a period to the saturation of limited joints.

    A limited torque does not depend on the velocity, so its slope is zero.
    """
    part = get(w, share)
    for j in range(n):
        x, most = get(w, torque + j), get(w, limits + j)
        high, low = x > most, x < -most
        put(w, torque + j, where(high, most, where(low, -most, x)))
        put(w, slope + j, where(high | low, 0.0 * x, get(w, slope + j)))
        put(w, saturation + j, get(w, saturation + j) + where(high | low, part, 0.0 * x))


@stage
def integrate_servo_error(
    w, step, n="count", h="row", held="whole", demand="n", torque="n", error="n", integral="n"
):
    """Integrate the errors of the velocity loops over `held` sub-steps.

    Errors that would limit a limited torque further are left out, so that the integral does not
    wind up.
    """
    seconds = held * get(w, h)
    for j in range(n):
        excess = get(w, demand + j) - get(w, torque + j)
        free = excess * get(w, error + j) <= 0.0
        z = get(w, integral + j)
        put(w, integral + j, where(free, z + seconds * get(w, error + j), z))


@stage
def resist_motion(
    w,
    step,
    n="count",
    h="row",
    armature="n",
    damping="n",
    friction="n",
    torque="n",
    slope="n",
    v="n",
    hold="n",
    net="n",
    diagonal="n",
):
    """Compute net torques after friction, and the inertias that are added at the joints.

    `hold` is the torque with which friction held a resting joint in the last sub-step.
    """
    for j in range(n):
        x, held, most = get(w, v + j), get(w, hold + j), get(w, friction + j)
        zero = 0.0 * x
        along = where(x == 0.0, held, x)
        sign = where(along > 0.0, 1.0 + zero, where(along < 0.0, -1.0 + zero, zero))
        stuck = (x == 0.0) & (absolute(held) <= most) & (most > 0.0)
        viscous = get(w, damping + j)
        sliding = get(w, torque + j) - viscous * x - most * sign
        put(w, net + j, where(stuck, get(w, torque + j), sliding))
        own = get(w, armature + j) + get(w, h) * (get(w, slope + j) + viscous)
        put(w, diagonal + j, own + where(stuck, LOCK + zero, zero))


@stage
def advance_joints(
    w,
    step,
    n="count",
    h="row",
    command="n",
    friction="n",
    a="n",
    v="n",
    q="n",
    gap="n",
    hold="n",
    unstable="row",
):
    """Integrate velocities, positions and gaps over a sub-step.

    The velocities of a run stay as they are once a joint exceeds the speed FASTEST, and the row
    `unstable` becomes 1.
    """
    seconds = get(w, h)
    ok = get(w, unstable) == 0.0
    for j in range(n):
        ok = ok & (absolute(get(w, v + j) + seconds * get(w, a + j)) < FASTEST)
    put(w, unstable, where(ok, 0.0 * seconds, 1.0 + 0.0 * seconds))
    for j in range(n):
        x, held, most = get(w, v + j), get(w, hold + j), get(w, friction + j)
        zero = 0.0 * seconds
        acceleration = where(ok, get(w, a + j), zero)
        stuck = (x == 0.0) & (absolute(held) <= most) & (most > 0.0)
        after = x + seconds * acceleration
        stops = ((where(x == 0.0, held, x) * after) <= 0.0) & (most > 0.0)
        after = where(stuck | stops, zero, after)
        put(w, hold + j, where(stuck, LOCK * acceleration, zero))
        put(w, v + j, after)
        move = where(ok, seconds * after, zero)
        put(w, q + j, get(w, q + j) + move)
        put(w, gap + j, get(w, gap + j) + where(ok, seconds * get(w, command + j), zero) - move)


@stage
def begin_substeps(w, step, n="count", parts="row", dt="row", h="row", saturation="n"):
    """Compute the length h of the sub-steps of a time dt, and clear the saturation."""
    put(w, h, get(w, dt) / get(w, parts))
    for j in range(n):
        put(w, saturation + j, 0.0)


@stage
def attach_payload(w, step, first="whole", last="whole", payload="10", bodies="10", loaded="10"):
    """Add the inertia of a payload to that of its body from step `first` until before `last`."""
    carried = 1.0 if first < step <= last else 0.0
    for i in range(10):
        put(w, loaded + i, get(w, bodies + i) + carried * get(w, payload + i))


@stage
def scale_inertias(w, step, n="count", factor="row", true="n, 10", believed="n, 10"):
    """Compute believed inertias, a factor times the true inertias."""
    for i in range(10 * n):
        put(w, believed + i, get(w, factor) * get(w, true + i))


@stage
def judge_stability(w, step, unstable="row", code="row", outcome="row"):
    """Replace the outcome of runs whose joints became unstable."""
    put(w, outcome, where(get(w, unstable) > 0.0, get(w, code), get(w, outcome)))


@stage
def copy_single_rows(w, step, each="each: source=row; to=row"):
    """Copy rows, each to another row."""
    for i in range(each[0]):
        put(w, each[2 * i + 2], get(w, each[2 * i + 1]))


@stage
def place_carrier(w, step, T="3, 4", twist="6", rotation="9", omega="3", acceleration="3"):
    """Compute rotation, angular velocity and acceleration of a body that moves as commanded.

    The twist (v, omega) is in the axes of the body, and constant there, so that the acceleration of
    the origin is omega x v.
    """
    for r in range(3):
        for c in range(3):
            put(w, rotation + 3 * r + c, get(w, T + 4 * r + c))
    x, y, z = get(w, twist), get(w, twist + 1), get(w, twist + 2)
    a, b, c = get(w, twist + 3), get(w, twist + 4), get(w, twist + 5)
    put(w, omega, a)
    put(w, omega + 1, b)
    put(w, omega + 2, c)
    put(w, acceleration, b * z - c * y)
    put(w, acceleration + 1, c * x - a * z)
    put(w, acceleration + 2, a * y - b * x)
