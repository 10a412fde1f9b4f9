"""Poses and Jacobians of frames at many configurations, with the run first, as users have them.

The stages of a program place a block of runs at a time, so that a million configurations cost
each what a thousand do. All arrays of the user's are flat.
"""

from robsim.kernels.machine.jit import kernel
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import perform_on_block

USUAL_COORDINATE = (
    12.0  # metres or radians: below two turns, from where on an angle may be in degrees
)


@kernel
def _load_configurations(q, start, first, block):
    """Copy q[start..., n] to rows of a block; return whether all are finite and small.

    Then nobody needs to look at them. Where runs are left over, the last one stands in for them.
    """
    unusual = 0
    for lane in range(WIDTH):
        b = min(start + lane, q.shape[0] - 1)
        for i in range(q.shape[1]):
            block[(first + i) * WIDTH + lane] = q[b, i]
            unusual += 0 if abs(q[b, i]) <= USUAL_COORDINATE else 1
    return unusual == 0


@kernel
def fill_frame_poses(addresses, at, p, template, first, found, q, out):
    """Compute homogeneous out[run, frame, 4, 4] of frames, whose poses stand in rows found[frame].

    Return whether all coordinates are usual: else they are for Python to check.
    """
    frames, block, usual = found.size, template.copy(), True
    runs = out.size // (16 * frames)
    rows, placed = q.reshape(runs, q.size // max(runs, 1)), out.reshape(runs, frames, 4, 4)
    for start in range(0, runs, WIDTH):
        usual = _load_configurations(rows, start, first, block) and usual
        perform_on_block(addresses, at, p, block, 0)
        for lane in range(min(WIDTH, runs - start)):
            for f in range(frames):
                _write_homogeneous(block, found[f], lane, placed[start + lane, f])
    return usual


@kernel
def _write_homogeneous(block, T, lane, out):
    for r in range(3):
        for c in range(4):
            out[r, c] = block[(T + 4 * r + c) * WIDTH + lane]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@kernel
def fill_jacobians(addresses, at, p, template, first, found, q, out):
    """Compute out[run, :], a Jacobian row by row, from rows that begin at `found`.

    Return as `fill_frame_poses` does.
    """
    block, usual = template.copy(), True
    runs, size = out.shape
    rows = q.reshape(runs, q.size // max(runs, 1))
    for start in range(0, runs, WIDTH):
        usual = _load_configurations(rows, start, first, block) and usual
        perform_on_block(addresses, at, p, block, 0)
        for lane in range(min(WIDTH, runs - start)):
            for i in range(size):
                out[start + lane, i] = block[(found + i) * WIDTH + lane]
    return usual
