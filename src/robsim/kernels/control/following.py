"""Stages of trajectories: where they are now and a period later, and how axes follow them.

A trajectory stands in a table, or is planned from where each run starts. The rows of where it is a
period later, `ahead`, follow those of now, `here`.
"""

from robsim.kernels.formulas.timing import fastest, share
from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.memory import reals
from robsim.kernels.machine.stage import stage

ENDED = 1e-9  # of a period: times that differ by less are one


@stage
def looked_up(p, w, step):
    """Read a trajectory from a table [times, n], one row for each step: (address, times, n, here).

    Its last row holds for ever.
    """
    times, n = p[1], p[2]
    table = reals(p[0], times * n)
    for later in range(2):
        at = min(step + later, times - 1) * n
        for i in range(n):
            put(w, p[3] + later * n + i, table[at + i])


@stage
def remembered(p, w, step):
    """Keep rows as they are at the start: (to, n), and the rows."""
    if step == 0:
        for i in range(p[1]):
            put(w, p[0] + i, get(w, p[2 + i]))


@stage
def paced(p, w, step):
    """Plan the shortest time of n ways at the start: (n, ways, limits, ramps, seconds).

    The limits are n speeds and n accelerations.
    """
    n, ways, limits, ramps, seconds = p[0], p[1], p[2], p[3], p[4]
    if step > 0:
        return
    for i in range(n):
        for b in range(WIDTH):
            way, speed = abs(w[(ways + i) * WIDTH + b]), w[(limits + i) * WIDTH + b]
            needed, ramp = fastest(way, speed, w[(limits + n + i) * WIDTH + b])
            at = seconds * WIDTH + b
            w[at] = max(w[at], needed) if i > 0 else needed
            w[(ramps + i) * WIDTH + b] = ramp


@kernel
def _axes(p, w, step):
    """Fill the rows of `ahead` of `axes`, with the time of a step."""
    n, seconds, ramps, start, ways, goal, out = p[0], p[2], p[3], p[4], p[5], p[6], p[7] + p[0]
    for b in range(WIDTH):
        t, T = step * w[p[1] * WIDTH + b], w[seconds * WIDTH + b]
        for i in range(n):
            at = i * WIDTH + b
            s, _, _ = share(t, T, w[ramps * WIDTH + at])
            there = w[start * WIDTH + at] + s * w[ways * WIDTH + at]
            w[out * WIDTH + at] = there if s < 1.0 else w[goal * WIDTH + at]


@stage
def axes(p, w, step):
    """Compute where axes are: (n, dt, seconds, ramps, start, ways, goal, here)."""
    n, here = p[0], p[7]
    if step == 0:
        _axes(p, w, 0)
    for i in range(n):
        put(w, here + i, get(w, here + n + i))
    _axes(p, w, step + 1)


@stage
def towards(p, w, step):
    """Compute the velocities of axes that take them on, and back: (n, here, gain, dt, qd).

    Then of each commanded velocity the number of its axis, and the row of its coordinate. What is
    missed is made up for at the gain, at most all of it in a period.
    """
    n, here, dt = p[0], p[1], get(w, p[3])
    rate = get(w, p[2])
    rate = where(rate < 1.0 / dt, rate, 1.0 / dt)
    for i in range(n):
        r = get(w, here + p[5 + 2 * i])
        on = (get(w, here + n + p[5 + 2 * i]) - r) / dt
        put(w, p[4] + i, on + rate * (r - get(w, p[6 + 2 * i])))


@stage
def going(p, w, step):
    """Compute whether trajectories are not over: (seconds, dt, out)."""
    dt = get(w, p[1])
    put(w, p[2], where(step * dt < get(w, p[0]) - ENDED * dt, 1.0, 0.0 * dt))
