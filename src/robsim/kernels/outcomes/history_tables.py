"""Stages that record runs in tables of all runs."""

from robsim.kernels.machine.array_views import reals, unsigned_row
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import stage


@stage
def record_instant(
    w,
    step,
    every="whole",
    table="table: runs, instants, width",
    instants="count",
    width="count",
    run="row",
    alive="row",
    groups="each: rows=n; n=count",
    runs="count",
):
    """Write the rows of the groups to table[run, instant, :] at every `every`-th step.

    `run` is the index of the run, and a group is (first row, number of rows).
    """
    if step % every:
        return
    for i in range(WIDTH):
        if w[alive * WIDTH + i] != 0.0:
            index = int(unsigned_row(w, run)[i])
            line = reals(table + 8 * (index * instants + step // every) * width, width)
            _copy_groups(groups, w, i, line)


@part
def _copy_groups(groups, w, i, line):
    """Copy the numbers of one lane from the groups of rows to a line of a table."""
    done = 0
    for group in range(groups[0]):
        for j in range(groups[2 + 2 * group]):
            line[done] = w[(groups[1 + 2 * group] + j) * WIDTH + i]
            done += 1


@stage
def record_ending(
    w,
    step,
    table="table: runs, width",
    width="count",
    run="row",
    alive="row",
    outcome="row",
    groups="each: rows=n; n=count",
    runs="count",
):
    """Write the final state of runs with an outcome to table[run, :], and end these runs.

    A line of the table holds the rows of the groups, the step number and the outcome. The row
    `alive` of an ended run is 0.
    """
    for i in range(WIDTH):
        if w[alive * WIDTH + i] != 0.0 and w[outcome * WIDTH + i] != 0.0:
            line = reals(table + 8 * int(unsigned_row(w, run)[i]) * width, width)
            _copy_groups(groups, w, i, line)
            line[width - 2], line[width - 1] = step, w[outcome * WIDTH + i]
            w[alive * WIDTH + i] = 0.0
