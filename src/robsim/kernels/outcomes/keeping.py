"""Stages that keep what happened in tables of all runs."""

from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.memory import reals, unsigned
from robsim.kernels.machine.stage import stage


@stage
def keep(p, w, step):
    """Keep every so many steps: (every, table, instants, width, run, alive), and groups of rows.

    table[run, instant, :] are the rows of the groups, each (first row, how many).
    """
    every, instants, width = p[0], p[2], p[3]
    if step % every:
        return
    for i in range(WIDTH):
        if w[p[5] * WIDTH + i] != 0.0:
            run = int(unsigned(w, p[4])[i])
            table = reals(p[1] + 8 * (run * instants + step // every) * width, width)
            _copy(p, 6, w, i, width, table)


@part
def _copy(p, at, w, i, width, table):
    done = 0
    while done < width:
        for j in range(p[at + 1]):
            table[done] = w[(p[at] + j) * WIDTH + i]
            done += 1
        at += 2


@stage
def end(p, w, step):
    """Keep the end of runs that have an outcome: (table, width, run, alive, outcome), and groups.

    table[run, :] are the rows of the groups, the number of the step, and the outcome; from then on
    the run is not alive.
    """
    width = p[1]
    for i in range(WIDTH):
        if w[p[3] * WIDTH + i] != 0.0 and w[p[4] * WIDTH + i] != 0.0:
            table = reals(p[0] + 8 * int(unsigned(w, p[2])[i]) * width, width)
            _copy(p, 5, w, i, width - 2, table)
            table[width - 2], table[width - 1] = step, w[p[4] * WIDTH + i]
            w[p[3] * WIDTH + i] = 0.0
