"""Poses and Jacobians of frames at many configurations, for run-first arrays of users.

The stages of a program place one block of runs at a time, so the cost of a configuration does not
depend on their number. The arrays of users are flat.
"""

from robsim.kernels.machine.array_views import as_matrix
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import perform_on_block

USUAL_COORDINATE = 12.0  # metres or radians: a larger angle, about two turns, may be in degrees


@kernel
def _load_configurations(q, start, first, block):
    """Copy q[start:, n] to rows of a block. Return whether all coordinates are finite and usual.

    Usual coordinates need no further check in Python. If fewer than WIDTH runs remain, copies of
    the last run fill the block.
    """
    unusual = 0
    for lane in range(WIDTH):
        b = min(start + lane, q.shape[0] - 1)
        for i in range(q.shape[1]):
            block[(first + i) * WIDTH + lane] = q[b, i]
            unusual += 0 if abs(q[b, i]) <= USUAL_COORDINATE else 1
    return unusual == 0


@entry(
    "int64[::1], int64[::1], int64[::1], float64[::1], int64, int64[::1], float64[::1], "
    "out float64[::1] -> bool"
)
def fill_frame_poses(addresses, at, p, template, first, pose_rows, q, out):
    """Compute the homogeneous matrices out[run, frame, 4, 4] of frames.

    Rows from pose_rows[frame] on hold the pose of a frame. Return whether all coordinates are
    usual. Python must check unusual coordinates.
    """
    frames, block, usual = pose_rows.size, template.copy(), True
    runs = out.size // (16 * frames)
    rows, matrices = (
        as_matrix(q, runs, q.size // max(runs, 1)),
        as_matrix(out, 4 * runs * frames, 4),
    )
    for start in range(0, runs, WIDTH):
        usual = _load_configurations(rows, start, first, block) and usual
        perform_on_block(addresses, at, p, block, 0)
        for lane in range(min(WIDTH, runs - start)):
            for f in range(frames):
                row = 4 * ((start + lane) * frames + f)
                _write_homogeneous(block, pose_rows[f], lane, matrices[row : row + 4])
    return usual


@kernel
def _write_homogeneous(block, T, lane, out):
    """Copy the pose in rows T of one lane to a homogeneous matrix out[4, 4]."""
    for r in range(3):
        for c in range(4):
            out[r, c] = block[(T + 4 * r + c) * WIDTH + lane]
    out[3, 0], out[3, 1], out[3, 2], out[3, 3] = 0.0, 0.0, 0.0, 1.0


@entry(
    "int64[::1], int64[::1], int64[::1], float64[::1], int64, int64, float64[::1], "
    "out float64[:, ::1] -> bool"
)
def fill_jacobians(addresses, at, p, template, first, first_row, q, out):
    """Compute out[run, :], a Jacobian in row-major order, from rows that start at `first_row`.

    Return whether all coordinates are usual. Python must check unusual coordinates.
    """
    block, usual = template.copy(), True
    runs, size = out.shape
    rows = as_matrix(q, runs, q.size // max(runs, 1))
    for start in range(0, runs, WIDTH):
        usual = _load_configurations(rows, start, first, block) and usual
        perform_on_block(addresses, at, p, block, 0)
        for lane in range(min(WIDTH, runs - start)):
            for i in range(size):
                out[start + lane, i] = block[(first_row + i) * WIDTH + lane]
    return usual
