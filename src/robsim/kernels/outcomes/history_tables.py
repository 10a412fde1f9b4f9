"""Stages that keep what happened in tables of all runs."""

from robsim.kernels.machine.array_views import reals, unsigned_row
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import stage


@stage
def record_instant(
    w,
    step,
    every="whole",
    kept="table: runs, instants, width",
    instants="count",
    width="count",
    which="row",
    alive="row",
    groups="each: rows=n; n=count",
    runs="count",
):
    """Keep every so many steps: (every, table, instants, width, run, alive), and groups of rows.

    table[run, instant, :] are the rows of the groups, each (first row, how many).
    """
    if step % every:
        return
    for i in range(WIDTH):
        if w[alive * WIDTH + i] != 0.0:
            run = int(unsigned_row(w, which)[i])
            table = reals(kept + 8 * (run * instants + step // every) * width, width)
            _copy_groups(groups, w, i, table)


@part
def _copy_groups(groups, w, i, table):
    done = 0
    for group in range(groups[0]):
        for j in range(groups[2 + 2 * group]):
            table[done] = w[(groups[1 + 2 * group] + j) * WIDTH + i]
            done += 1


@stage
def record_ending(
    w,
    step,
    kept="table: runs, width",
    width="count",
    which="row",
    alive="row",
    outcome="row",
    groups="each: rows=n; n=count",
    runs="count",
):
    """Keep the end of runs that have an outcome: (table, width, run, alive, outcome), and groups.

    table[run, :] are the rows of the groups, the number of the step, and the outcome; from then on
    the run is not alive.
    """
    for i in range(WIDTH):
        if w[alive * WIDTH + i] != 0.0 and w[outcome * WIDTH + i] != 0.0:
            table = reals(kept + 8 * int(unsigned_row(w, which)[i]) * width, width)
            _copy_groups(groups, w, i, table)
            table[width - 2], table[width - 1] = step, w[outcome * WIDTH + i]
            w[alive * WIDTH + i] = 0.0
