"""Lag and limits of joints that follow a velocity command, and the quantisation of encoders."""

import math

from robsim.kernels.formulas.quantiser import round_to_step
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage


@kernel
def lagged_velocity(u, lag, limit, rate, dt, v):
    """Return the velocity after dt under the command u, and the mean velocity over dt.

    The joint obeys v' = (u - v) / lag with |u| <= limit and |v'| <= rate. While (u - v) / lag
    exceeds the rate, v follows a ramp for the time (|u - v| - rate lag) / rate. Then the remaining
    gap decays as exp(-t / lag). Both parts are integrated in closed form.
    """
    goal = min(max(u, -limit), limit)
    gap, ramp = goal - v, 0.0
    if abs(gap) > rate * lag:  # false for an infinite rate, as inf * 0 is NaN
        ramp = min(abs(gap) / rate - lag, dt)
    climb = math.copysign(rate * ramp, gap) if ramp > 0.0 else 0.0
    path = (v + 0.5 * climb) * ramp
    gap, rest = gap - climb, dt - ramp
    if lag > 0.0:
        path += goal * rest + gap * lag * math.expm1(-rest / lag)
        gap *= math.exp(-rest / lag)
    elif rest > 0.0:
        path += goal * rest
        gap = 0.0
    return goal - gap, path / dt


@stage
def follow_commands(
    w,
    step,
    n="count",
    dt="row",
    lag="row",
    limits="n",
    rates="n",
    each="each: command=row; v=row; mean=row",
):
    """Update the velocities v of n joints that follow their commands, and their means over dt.

    `limits` bound the speeds and `rates` the accelerations.
    """
    dt, lag = dt * WIDTH, lag * WIDTH
    for i in range(n):
        u, v, mean = each[1 + 3 * i] * WIDTH, each[2 + 3 * i] * WIDTH, each[3 + 3 * i] * WIDTH
        limit, rate = (limits + i) * WIDTH, (rates + i) * WIDTH
        for b in range(WIDTH):
            w[v + b], w[mean + b] = lagged_velocity(
                w[u + b], w[lag + b], w[limit + b], w[rate + b], w[dt + b], w[v + b]
            )


@stage
def quantise_encoders(w, step, n="count", steps="n", q="n", out="n"):
    """Quantise coordinates q to encoder steps. A step of zero means no quantisation."""
    for i in range(n):
        put(w, out + i, round_to_step(get(w, q + i), get(w, steps + i)))
