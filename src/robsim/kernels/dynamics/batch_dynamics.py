"""Dynamics at many configurations, and motion over many steps, for run-first arrays of users.

The stages of a program compute one block of runs at a time, so the cost of a configuration does not
depend on their number. The arrays of users are flat.
"""

from robsim.kernels.machine.array_views import reals, wholes
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.lanes import WIDTH, absolute, any_lane, get, put
from robsim.kernels.machine.stages import perform_on_block

USUAL_COORDINATE = 12.0  # metres or radians: a larger angle, about two turns, may be in degrees
LARGEST = 1e300  # other numbers may be infinite or NaN


@routine
def _load_runs(x, start, runs, first, block):
    """Copy the runs x[start:] of a flat array to rows of a block.

    If fewer than WIDTH runs remain, copies of the last run fill the block.
    """
    count = x.size // runs
    if runs == 1:
        for i in range(count):
            put(block, first + i, x[i])
    elif start + WIDTH <= runs:
        for i in range(count):
            for lane in range(WIDTH):
                block[(first + i) * WIDTH + lane] = x[(start + lane) * count + i]
    else:
        for i in range(count):
            for lane in range(WIDTH):
                at = min(start + lane, runs - 1) * count
                block[(first + i) * WIDTH + lane] = x[at + i]


@routine
def _are_within(block, first, count, largest):
    """Return whether the magnitudes of all numbers in rows are at most `largest`."""
    excess = absolute(get(block, first)) < 0.0
    for i in range(count):
        excess = excess | ~(absolute(get(block, first + i)) <= largest)
    return not any_lane(excess)


@routine
def _fill_runs(code, block, runs, q, v, a, out):
    """Compute out[run, :], see `fill_dynamics`."""
    stages, output, usual = code[3], code[4], True
    addresses, at, p = (
        code[5 : 5 + stages],
        code[5 + stages : 5 + 2 * stages],
        code[5 + 2 * stages :],
    )
    nq, nv, size = q.size // runs, v.size // runs, out.size // runs
    for start in range(0, runs, WIDTH):
        _load_runs(q, start, runs, 0, block)
        _load_runs(v, start, runs, nq, block)
        _load_runs(a, start, runs, nq + nv, block)
        perform_on_block(addresses, at, p, block, 0)
        usual = usual and _are_within(block, 0, nq, USUAL_COORDINATE)
        usual = usual and _are_within(block, nq, 2 * nv, LARGEST)
        usual = usual and _are_within(block, output, size, LARGEST)
        if start + WIDTH <= runs:
            for i in range(size):
                for lane in range(WIDTH):
                    out[(start + lane) * size + i] = block[(output + i) * WIDTH + lane]
        else:
            for lane in range(runs - start):
                for i in range(size):
                    out[(start + lane) * size + i] = block[(output + i) * WIDTH + lane]
    return usual


@entry("int64, int64, float64[::1], float64[::1], float64[::1], out float64[::1] -> bool")
def fill_dynamics(code, runs, q, v, a, out):
    """Compute out[run, :] of runs at coordinates q, with arrays v and a; all arrays are flat.

    `code` is the address of whole numbers: the length of the code, the address of a block and its
    number of rows, the number of stages, the first row of the output, the addresses of the stages,
    the offsets of their numbers, and the numbers. The rows of the block hold q from row 0, then v
    and a. Return whether all coordinates are usual, and all numbers and results finite. Python must
    check others.
    """
    numbers = wholes(code, wholes(code, 1)[0])
    block = reals(numbers[1], WIDTH * numbers[2])
    return _fill_runs(numbers, block, runs, q, v, a, out)


@entry("int64, int64, float64[::1], out float64[::1] -> bool")
def fill_positions(code, runs, q, out):
    """Compute out[run, :] as `fill_dynamics` does, of a quantity that depends on q alone."""
    numbers = wholes(code, wholes(code, 1)[0])
    block = reals(numbers[1], WIDTH * numbers[2])
    return _fill_runs(numbers, block, runs, q, q[:0], q[:0], out)


@entry(
    "int64, int64, float64[:, ::1], float64[:, ::1], float64[:, :, ::1], out float64[:, :, ::1], "
    "out float64[:, :, ::1] -> bool"
)
def fill_motion(code, steps, q, v, torque, q_out, v_out):
    """Compute q_out[run, step, :] and v_out[run, step, :] of a motion from q[run, :], v[run, :].

    The stages perform one step. The code is described in `fill_dynamics`. The rows of the block
    hold q from row 0, then v and the torque. The array torque[run, step, :] has one step if it is
    constant.
    """
    code = wholes(code, wholes(code, 1)[0])
    block, stages = reals(code[1], WIDTH * code[2]), code[3]
    addresses, at, p = (
        code[5 : 5 + stages],
        code[5 + stages : 5 + 2 * stages],
        code[5 + 2 * stages :],
    )
    runs, nq = q.shape
    nv, held = v.shape[1], torque.shape[1]
    for start in range(0, runs, WIDTH):
        for lane in range(WIDTH):
            run = min(start + lane, runs - 1)
            for i in range(nq):
                block[i * WIDTH + lane] = q[run, i]
            for i in range(nv):
                block[(nq + i) * WIDTH + lane] = v[run, i]
        for step in range(steps + 1):
            for lane in range(WIDTH):
                run = min(start + lane, runs - 1)
                for i in range(nv):
                    tau = torque[run, min(step, held - 1), i]
                    block[(nq + nv + i) * WIDTH + lane] = tau
            for lane in range(min(WIDTH, runs - start)):
                for i in range(nq):
                    q_out[start + lane, step, i] = block[i * WIDTH + lane]
                for i in range(nv):
                    v_out[start + lane, step, i] = block[(nq + i) * WIDTH + lane]
            if step < steps:
                perform_on_block(addresses, at, p, block, step)
