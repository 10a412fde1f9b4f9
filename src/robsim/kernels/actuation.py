"""The lag and limits of joints that follow a command, and encoders that count in steps."""

import math

from robsim.kernels.jit import kernel
from robsim.kernels.steps import in_steps


@kernel
def follow(u, lag, limit, rate, dt, v, mean):
    """Compute the mean velocity mean[i, b] over dt under the command u[i, b], and update v.

    v' = (u - v) / lag, where |u| <= limit[i] and |v'| <= rate[i]. While (u - v) / lag exceeds the
    rate, v goes along a ramp, for (|u - v| - rate lag) / rate; then the rest of the gap decays as
    exp(-t / lag). Both parts are integrated in closed form.
    """
    for i in range(u.shape[0]):
        for b in range(u.shape[1]):
            goal = min(max(u[i, b], -limit[i]), limit[i])
            gap = goal - v[i, b]
            ramp = 0.0
            if abs(gap) > rate[i] * lag:  # never where the rate is infinite: inf * 0 is NaN
                ramp = min(abs(gap) / rate[i] - lag, dt)
            climb = math.copysign(rate[i] * ramp, gap) if ramp > 0.0 else 0.0
            way = (v[i, b] + 0.5 * climb) * ramp
            gap, rest = gap - climb, dt - ramp
            if lag > 0.0:
                way += goal * rest + gap * lag * math.expm1(-rest / lag)
                gap *= math.exp(-rest / lag)
            elif rest > 0.0:
                way += goal * rest
                gap = 0.0
            v[i, b] = goal - gap
            mean[i, b] = way / dt


@kernel
def count(step, q, out):
    """Compute out[i, b] = q rounded to whole steps, or q itself where the step is zero."""
    for i in range(q.shape[0]):
        for b in range(q.shape[1]):
            out[i, b] = in_steps(q[i, b], step[i])
