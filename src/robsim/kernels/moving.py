"""Stages that move coordinates by velocities that are held for a period, exactly."""

from robsim.kernels import joints
from robsim.kernels.lanes import WIDTH, get, put
from robsim.kernels.memory import vector
from robsim.kernels.stage import stage


@stage
def run(p, w, step):
    """Compute q + dt v: (dt, n), and (q, v) of each."""
    dt = get(w, p[0])
    for i in range(p[1]):
        q, v = p[2 + 2 * i], p[3 + 2 * i]
        put(w, q, get(w, q) + dt * get(w, v))


@stage
def fly(p, w, step):
    """Move a floating body: (dt, q, v)."""
    joints.integrate_floating(vector(w, p[2], 6), w[p[0] * WIDTH], vector(w, p[1], 7))


@stage
def glide(p, w, step):
    """Move a body in its plane: (dt, q, v, velocities)."""
    joints.integrate_in_plane(vector(w, p[2], p[3]), w[p[0] * WIDTH], vector(w, p[1], 3))


@stage
def roll(p, w, step):
    """Add the rolling of a wheel to its angle: (dt, angle, v of the vehicle, ratio)."""
    speed = get(w, p[3]) * get(w, p[2]) + get(w, p[3] + 1) * get(w, p[2] + 1)
    put(w, p[1], get(w, p[1]) + get(w, p[0]) * speed)


@stage
def spread(p, w, step):
    """Compute all velocities: those that are commanded, else those prescribed.

    (n, v, prescribed), and of each the row of its command, or -1
    """
    for i in range(p[0]):
        command = p[3 + i]
        put(w, p[1] + i, get(w, command if command >= 0 else p[2] + i))
