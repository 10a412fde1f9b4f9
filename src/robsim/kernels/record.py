"""From the run-last arrays of a chunk into the run-first record of all runs."""

from robsim.kernels.jit import kernel


@kernel
def _store(values, rows, moment, out):
    for b in range(rows.size):
        for i in range(values.shape[0]):
            out[rows[b], moment, i] = values[i, b]


@kernel
def store(rows, moment, q, qd, s, pixels, q_out, qd_out, s_out, pixels_out):
    """out[rows[b], moment, i] = values[i, b] for each of the four."""
    _store(q, rows, moment, q_out)
    _store(qd, rows, moment, qd_out)
    _store(s, rows, moment, s_out)
    _store(pixels, rows, moment, pixels_out)
