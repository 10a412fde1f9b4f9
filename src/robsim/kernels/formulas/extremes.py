"""The largest magnitude of several numbers of each run."""

from robsim.kernels.machine.kernel import kernel


@kernel
def largest_magnitude(x, out):
    """Compute out[b] = max_i |x[i, b]|. It is not finite if any x[i, b] is not finite."""
    out[:] = 0.0
    for i in range(x.shape[0]):
        for b in range(out.size):
            out[b] = max(out[b], abs(x[i, b]))
    for i in range(x.shape[0]):
        for b in range(out.size):
            out[b] += x[i, b] * 0.0
