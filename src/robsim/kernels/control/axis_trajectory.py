"""Stages that sample trajectories of axes, now and one period later, and track them.

A trajectory is stored in a table, or planned from the start of each run. `positions` has two
groups of rows: the positions now and the positions one period later.
"""

from robsim.kernels.formulas.speed_profiles import motion_share, shortest_time
from robsim.kernels.machine.array_views import reals
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage

TIME_TOLERANCE = 1e-9  # of a period: times with a smaller difference are equal


@stage
def look_up_trajectory(
    w, step, table="table: times, n", times="count", n="count", positions="2, n"
):
    """Read a trajectory from a table [times, n] with one row for each step.

    The trajectory stays at its last row.
    """
    table = reals(table, times * n)
    for later in range(2):
        at = min(step + later, times - 1) * n
        for i in range(n):
            put(w, positions + later * n + i, table[at + i])


@stage
def store_start(w, step, to="n", n="count", rows="each: row"):
    """Store the values of rows at step 0."""
    if step == 0:
        for i in range(n):
            put(w, to + i, get(w, rows[1 + i]))


@stage
def plan_shortest_time(
    w, step, n="count", displacements="n", limits="2, n", ramps="n", seconds="row"
):
    """Plan the shortest common duration of n axis motions at step 0.

    `displacements` are the signed lengths of the motions. The limits are n speeds and n
    accelerations. `ramps` are the acceleration times of the axes as shares of the duration.
    """
    if step > 0:
        return
    for i in range(n):
        for b in range(WIDTH):
            length, speed = abs(w[(displacements + i) * WIDTH + b]), w[(limits + i) * WIDTH + b]
            needed, ramp = shortest_time(length, speed, w[(limits + n + i) * WIDTH + b])
            at = seconds * WIDTH + b
            w[at] = max(w[at], needed) if i > 0 else needed
            w[(ramps + i) * WIDTH + b] = ramp


@kernel
def _sample_axes(w, step, n, dt, seconds, ramps, start, displacements, goal, out):
    """Write the positions of n axes at the time of a step to the rows `out`."""
    for b in range(WIDTH):
        t, T = step * w[dt * WIDTH + b], w[seconds * WIDTH + b]
        for i in range(n):
            at = i * WIDTH + b
            s, _, _ = motion_share(t, T, w[ramps * WIDTH + at])
            there = w[start * WIDTH + at] + s * w[displacements * WIDTH + at]
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
    displacements="n",
    goal="n",
    positions="2, n",
):
    """Compute the positions of n axes on their planned motions, now and one period later."""
    ahead = positions + n
    if step == 0:
        _sample_axes(w, 0, n, dt, seconds, ramps, start, displacements, goal, ahead)
    for i in range(n):
        put(w, positions + i, get(w, positions + n + i))
    _sample_axes(w, step + 1, n, dt, seconds, ramps, start, displacements, goal, ahead)


@stage
def track_axes(
    w,
    step,
    n="count",
    positions="2, n",
    gain="row",
    duration="row",
    qd="n",
    axes="each: axis=whole; q=row",
):
    """Compute velocities that move axes along their trajectories and reduce their deviations.

    A deviation decays exponentially with the gain, or vanishes in one period if gain dt > 1. Each
    entry of axes is the index of an axis and the row of its coordinate.
    """
    dt = get(w, duration)
    rate = get(w, gain)
    rate = where(rate < 1.0 / dt, rate, 1.0 / dt)
    for i in range(n):
        r = get(w, positions + axes[1 + 2 * i])
        feed_forward = (get(w, positions + n + axes[1 + 2 * i]) - r) / dt
        put(w, qd + i, feed_forward + rate * (r - get(w, axes[2 + 2 * i])))


@stage
def flag_running_trajectory(w, step, seconds="row", duration="row", out="row"):
    """Compute 1 while a trajectory is running, else 0."""
    dt = get(w, duration)
    put(w, out, where(step * dt < get(w, seconds) - TIME_TOLERANCE * dt, 1.0, 0.0 * dt))
