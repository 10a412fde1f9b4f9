"""The plane that marks lie in, from their image and their depths."""

import numpy as np

from robsim.kernels.jit import kernel
from robsim.kernels.moments import mean


@kernel
def fit_plane(x, Z, ABC):
    """ABC[3, b] of the plane 1/Z = A x + B y + C through marks x[n, 2, b] at depths Z[n, b].

    Least squares in the inverse depths: exact if the marks lie in a plane that misses the camera.
    """
    centre, sums = np.empty((2, x.shape[2])), np.zeros((6, x.shape[2]))
    mean(x, centre)
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            sums[5, b] += 1.0 / Z[n, b] / x.shape[0]
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            u, v = x[n, 0, b] - centre[0, b], x[n, 1, b] - centre[1, b]
            w = 1.0 / Z[n, b] - sums[5, b]
            sums[0, b] += u * u
            sums[1, b] += u * v
            sums[2, b] += v * v
            sums[3, b] += u * w
            sums[4, b] += v * w
    for b in range(x.shape[2]):
        uu, uv, vv = sums[0, b], sums[1, b], sums[2, b]
        uw, vw, iz = sums[3, b], sums[4, b], sums[5, b]
        det = uu * vv - uv * uv
        A, B = (vv * uw - uv * vw) / det, (uu * vw - uv * uw) / det
        ABC[0, b], ABC[1, b] = A, B
        ABC[2, b] = iz - A * centre[0, b] - B * centre[1, b]
