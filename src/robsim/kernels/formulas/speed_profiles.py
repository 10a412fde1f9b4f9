"""Time laws of motions from rest to rest."""

import math

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part


@part
def quintic_profile(u):
    """Return s = 10 u^3 - 15 u^4 + 6 u^5 and its first two derivatives.

    The derivatives are zero at u = 0 and u = 1. The polynomial minimises the integral of the
    squared jerk (Craig 2005, section 7.3; Siciliano et al. 2009, section 4.2.1).
    """
    v = 1.0 - u
    s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return s, 30.0 * u * u * v * v, 60.0 * u * v * (1.0 - 2.0 * u)


@part
def _trapezoid_profile(u, ramp):
    """Return s of a trapezoidal speed profile and its first two derivatives.

    `ramp` is the share of the time for acceleration. The profile is symmetric, s(u) = 1 - s(1 - u),
    with the speed 1/(1 - ramp) between the ramps (Siciliano et al. 2009, eqs 4.5 to 4.8).
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
    """Return the share s of a motion that is completed at time t, and its time derivatives.

    `ramp` is the acceleration time, and the deceleration time, as a share of the duration. A
    negative ramp selects the quintic polynomial.
    """
    T = seconds if seconds > 0.0 else 1.0  # an axis with duration 0 does not move
    u = 1.0 if t >= seconds else min(max(t / T, 0.0), 1.0)
    s, rate, acceleration = quintic_profile(u) if ramp < 0.0 else _trapezoid_profile(u, ramp)
    if not 0.0 < t < seconds:
        return s, 0.0, 0.0
    per = 1.0 / T
    return s, rate * per, acceleration * per * per


@kernel
def shortest_time(distance, speed, acceleration):
    """Return the shortest duration of a motion within its limits, and the share for acceleration.

    If the speed limit is reached, d >= v^2/a, the duration is d/v + v/a. Otherwise the speed
    profile is a triangle and the duration is 2 sqrt(d/a) (Siciliano et al. 2009, section 4.2.1).
    """
    if distance * acceleration > speed * speed:
        climb = speed / acceleration
        seconds = distance / speed + climb
        return seconds, climb / seconds
    return 2.0 * math.sqrt(distance / acceleration), 0.5


@entry("float64[::1], float64[::1], float64[::1], out float64[:, ::1]")
def compute_motion_shares(t, seconds, ramp, out):
    """Compute out[i] = share(t[i], seconds[i], ramp[i]) for n motions."""
    for i in range(t.size):
        out[i, 0], out[i, 1], out[i, 2] = motion_share(t[i], seconds[i], ramp[i])


@entry("float64[::1], float64[::1], float64[::1], out float64[::1], out float64[::1]")
def compute_shortest_times(distance, speed, acceleration, seconds, ramp):
    """Compute seconds[i] and ramp[i] of the shortest motions of n axes, see `shortest_time`."""
    for i in range(distance.size):
        seconds[i], ramp[i] = shortest_time(distance[i], speed[i], acceleration[i])
