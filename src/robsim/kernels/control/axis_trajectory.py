"""Stages of trajectories: where they are now and a period later, and how axes follow them.

A trajectory stands in a table, or is planned from where each run starts. The rows of where it is a
period later, `ahead`, follow those of now, `here`.
"""

from robsim.kernels.formulas.speed_profiles import motion_share, shortest_time
from robsim.kernels.machine.array_views import reals
from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage

TIME_TOLERANCE = 1e-9  # of a period: times that differ by less are one


@stage
def look_up_trajectory(w, step, table="table: times, n", times="count", n="count", here="2, n"):
    """Read a trajectory from a table [times, n], one row for each step: (address, times, n, here).

    Its last row holds for ever.
    """
    table = reals(table, times * n)
    for later in range(2):
        at = min(step + later, times - 1) * n
        for i in range(n):
            put(w, here + later * n + i, table[at + i])


@stage
def store_start(w, step, to="n", n="count", rows="each: row"):
    """Keep rows as they are at the start: (to, n), and the rows."""
    if step == 0:
        for i in range(n):
            put(w, to + i, get(w, rows[1 + i]))


@stage
def plan_shortest_time(w, step, n="count", ways="n", limits="2, n", ramps="n", seconds="row"):
    """Plan the shortest time of n ways at the start: (n, ways, limits, ramps, seconds).

    The limits are n speeds and n accelerations.
    """
    if step > 0:
        return
    for i in range(n):
        for b in range(WIDTH):
            way, speed = abs(w[(ways + i) * WIDTH + b]), w[(limits + i) * WIDTH + b]
            needed, ramp = shortest_time(way, speed, w[(limits + n + i) * WIDTH + b])
            at = seconds * WIDTH + b
            w[at] = max(w[at], needed) if i > 0 else needed
            w[(ramps + i) * WIDTH + b] = ramp


@kernel
def _sample_axes(w, step, n, dt, seconds, ramps, start, ways, goal, out):
    """Fill the rows of `ahead` of `sample_axis_trajectory`, with the time of a step."""
    for b in range(WIDTH):
        t, T = step * w[dt * WIDTH + b], w[seconds * WIDTH + b]
        for i in range(n):
            at = i * WIDTH + b
            s, _, _ = motion_share(t, T, w[ramps * WIDTH + at])
            there = w[start * WIDTH + at] + s * w[ways * WIDTH + at]
            w[out * WIDTH + at] = there if s < 1.0 else w[goal * WIDTH + at]


@stage
def sample_axis_trajectory(
    w,
    step,
    n="count",
    dt="row",
    seconds="row",
    ramps="n",
    start="n",
    ways="n",
    goal="n",
    here="2, n",
):
    """Compute where axes are: (n, dt, seconds, ramps, start, ways, goal, here)."""
    ahead = here + n
    if step == 0:
        _sample_axes(w, 0, n, dt, seconds, ramps, start, ways, goal, ahead)
    for i in range(n):
        put(w, here + i, get(w, here + n + i))
    _sample_axes(w, step + 1, n, dt, seconds, ramps, start, ways, goal, ahead)


@stage
def track_axes(
    w,
    step,
    n="count",
    here="2, n",
    gain="row",
    duration="row",
    qd="n",
    axes="each: axis=whole; q=row",
):
    """Compute the velocities of axes that take them on, and back: (n, here, gain, dt, qd).

    Then of each commanded velocity the number of its axis, and the row of its coordinate. What is
    missed is made up for at the gain, at most all of it in a period.
    """
    dt = get(w, duration)
    rate = get(w, gain)
    rate = where(rate < 1.0 / dt, rate, 1.0 / dt)
    for i in range(n):
        r = get(w, here + axes[1 + 2 * i])
        on = (get(w, here + n + axes[1 + 2 * i]) - r) / dt
        put(w, qd + i, on + rate * (r - get(w, axes[2 + 2 * i])))


@stage
def flag_running_trajectory(w, step, seconds="row", duration="row", out="row"):
    """Compute whether trajectories are not over: (seconds, dt, out)."""
    dt = get(w, duration)
    put(w, out, where(step * dt < get(w, seconds) - TIME_TOLERANCE * dt, 1.0, 0.0 * dt))
