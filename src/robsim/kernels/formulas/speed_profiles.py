"""The time laws of motions from rest to rest, number by number."""

import math

from robsim.kernels.machine.jit import kernel, part


@part
def quintic_profile(u):
    """Return s = 10 u^3 - 15 u^4 + 6 u^5 and its derivatives, zero at u = 0 and u = 1.

    The polynomial of least integral of the squared jerk (Craig 2005, section 7.3; Siciliano et
    al. 2009, section 4.2.1).
    """
    v = 1.0 - u
    s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return s, 30.0 * u * u * v * v, 60.0 * u * v * (1.0 - 2.0 * u)


@part
def _trapezoid_profile(u, ramp):
    """Return s of a trapezoidal speed profile with acceleration for the share `ramp`.

    It is symmetric, s(u) = 1 - s(1 - u), with the speed 1/(1 - ramp) in between (Siciliano et al.
    2009, eqs 4.5 to 4.8). Its derivatives come with it.
    """
    peak, early = 1.0 / (1.0 - ramp), min(u, 1.0 - u)
    if early < ramp:
        half, rate = peak * (0.5 * early * early / ramp), peak * (early / ramp)
        acceleration = (peak if u < 0.5 else -peak) / ramp
    else:
        half, rate, acceleration = peak * (early - 0.5 * ramp), peak, 0.0
    return half if u < 0.5 else 1.0 - half, rate, acceleration


@kernel
def motion_share(t, seconds, ramp):
    """Return the share s of a motion that is done at a time t, and its time derivatives.

    `ramp` is the share of the time in which an axis speeds up, and in which it slows down again;
    below 0 for the polynomial of order five.
    """
    T = seconds if seconds > 0.0 else 1.0  # an axis that needs no time does not move
    u = 1.0 if t >= seconds else min(max(t / T, 0.0), 1.0)
    s, rate, acceleration = quintic_profile(u) if ramp < 0.0 else _trapezoid_profile(u, ramp)
    if not 0.0 < t < seconds:
        return s, 0.0, 0.0
    per = 1.0 / T
    return s, rate * per, acceleration * per * per


@kernel
def shortest_time(way, speed, acceleration):
    """Return seconds of an axis within its limits, and the share of them for acceleration.

    T = d/v + v/a where the limit of the speed is reached, d >= v^2/a, and 2 sqrt(d/a) where not:
    the trapezoid is a triangle then (Siciliano et al. 2009, section 4.2.1).
    """
    if way * acceleration > speed * speed:
        climb = speed / acceleration
        seconds = way / speed + climb
        return seconds, climb / seconds
    return 2.0 * math.sqrt(way / acceleration), 0.5


@kernel
def compute_motion_shares(t, seconds, ramp, out):
    """Compute out[i] = `motion_share` of many times (n,), each with its own motion."""
    for i in range(t.size):
        out[i, 0], out[i, 1], out[i, 2] = motion_share(t[i], seconds[i], ramp[i])


@kernel
def compute_shortest_times(way, speed, acceleration, seconds, ramp):
    """Compute `shortest_time` of many axes (n,)."""
    for i in range(way.size):
        seconds[i], ramp[i] = shortest_time(way[i], speed[i], acceleration[i])
