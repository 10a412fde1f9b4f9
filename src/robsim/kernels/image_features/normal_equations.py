"""Normal equations of an error of very many numbers, as an error of seven numbers."""

import numpy as np

from robsim.kernels.machine.entry import entry

LEAST_PIVOT = 1e-9  # share of a diagonal element below which its direction counts as free


@entry(
    "float64[:, :, ::1], float64[:, ::1], float64[::1], out float64[:, ::1], out float64[:, :, ::1]"
)
def factor_normal_equations(H, g, c, s, L):
    """Compute errors s (B, 7) with interaction matrices L (B, 7, 6) from normal equations.

    With the Cholesky factor R'R = H, upper triangular,

        s = (R'^-1 g, sqrt(c - |R'^-1 g|^2)),    L = [R; 0],

    so that the pseudo-inverse gives L^+ s = H^-1 g, and |s|^2 = c. A direction that H does not
    determine has a row of zeros.

    Parameters
    ----------
    H : array of shape (B, 6, 6)
        Matrices L'L of the large error.
    g : array of shape (B, 6)
        Products L'e.
    c : array of shape (B,)
        Squares e'e.
    s, L : arrays of shape (B, 7) and (B, 7, 6)
        The results.
    """
    for run in range(len(H)):
        R, e = L[run], s[run]
        R[:] = 0.0
        total = 0.0
        for i in range(6):
            pivot = H[run, i, i]
            rest = g[run, i]
            for k in range(i):
                pivot -= R[k, i] * R[k, i]
                rest -= R[k, i] * e[k]
            root = np.sqrt(pivot) if pivot > LEAST_PIVOT * H[run, i, i] else 0.0
            free = not (root > 0.0)
            e[i] = 0.0 if free else rest / root
            for j in range(i, 6):
                entry = H[run, i, j]
                for k in range(i):
                    entry -= R[k, i] * R[k, j]
                R[i, j] = 0.0 if free else entry / root
            total += e[i] * e[i]
        e[6] = np.sqrt(max(c[run] - total, 0.0)) if c[run] == c[run] else np.nan
