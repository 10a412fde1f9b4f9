"""The lag and limits of joints that follow a command, and encoders that count in steps."""

import math

from robsim.kernels.formulas.steps import in_steps
from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stage import stage


@kernel
def followed(u, lag, limit, rate, dt, v):
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
def follow(p, w, step):
    """Let velocities follow: (n, dt, lag, limits, rates), and (command, v, mean) of each."""
    dt, lag = p[1] * WIDTH, p[2] * WIDTH
    for i in range(p[0]):
        u, v, mean = p[5 + 3 * i] * WIDTH, p[6 + 3 * i] * WIDTH, p[7 + 3 * i] * WIDTH
        limit, rate = (p[3] + i) * WIDTH, (p[4] + i) * WIDTH
        for b in range(WIDTH):
            w[v + b], w[mean + b] = followed(
                w[u + b], w[lag + b], w[limit + b], w[rate + b], w[dt + b], w[v + b]
            )


@stage
def count(p, w, step):
    """Compute coordinates as encoders read them: (n, steps, q, out), steps of zero for none."""
    for i in range(p[0]):
        put(w, p[3] + i, in_steps(get(w, p[2] + i), get(w, p[1] + i)))
