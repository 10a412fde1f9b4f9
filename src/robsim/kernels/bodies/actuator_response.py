"""The lag and limits of joints that follow a command, and encoders that count in steps."""

import math

from robsim.kernels.formulas.quantiser import round_to_step
from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage


@kernel
def lagged_velocity(u, lag, limit, rate, dt, v):
    """Return the velocity after dt under the command u, and its mean until then.

    v' = (u - v) / lag, where |u| <= limit and |v'| <= rate. While (u - v) / lag exceeds the rate, v
    goes along a ramp, for (|u - v| - rate lag) / rate; then the rest of the gap decays as
    exp(-t / lag). Both parts are integrated in closed form.
    """
    goal = min(max(u, -limit), limit)
    gap, ramp = goal - v, 0.0
    if abs(gap) > rate * lag:  # never where the rate is infinite: inf * 0 is NaN
        ramp = min(abs(gap) / rate - lag, dt)
    climb = math.copysign(rate * ramp, gap) if ramp > 0.0 else 0.0
    way = (v + 0.5 * climb) * ramp
    gap, rest = gap - climb, dt - ramp
    if lag > 0.0:
        way += goal * rest + gap * lag * math.expm1(-rest / lag)
        gap *= math.exp(-rest / lag)
    elif rest > 0.0:
        way += goal * rest
        gap = 0.0
    return goal - gap, way / dt


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
    """Let velocities follow: (n, dt, lag, limits, rates), and (command, v, mean) of each."""
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
    """Compute coordinates as encoders read them: (n, steps, q, out), steps of zero for none."""
    for i in range(n):
        put(w, out + i, round_to_step(get(w, q + i), get(w, steps + i)))
