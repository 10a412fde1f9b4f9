"""Centred moments of the grey values of a picture, and their rates, from moments about the axis."""

from robsim.kernels.formulas.image_moments import ORDER_3, moment_index, moment_powers
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel


@kernel
def shift_moment(m, k, x, y):
    """Return moment k about (x, y) from the moments m (10,) about the origin.

    It is the sum of C(i, p) C(j, q) (-x)^(i - p) (-y)^(j - q) m_pq.
    """
    i, j = moment_powers(k)
    total, column = 0.0, 1.0  # column: C(i, p) (-x)^(i - p), from p = i downwards
    for p in range(i, -1, -1):
        row = column
        for q in range(j, -1, -1):
            total += row * m[moment_index(p, q)]
            row *= -y * q / (j - q + 1)
        column *= -x * p / (i - p + 1)
    return total


@entry(
    "float64[:, ::1], float64[:, :, ::1], out float64[:, ::1], out float64[:, ::1], "
    "out float64[:, :, ::1]"
)
def centre_moments(m, Lm, centre, mu, R):
    """Compute centres, centred moments and their rates as `formulas.image_moments` stores them.

    Parameters
    ----------
    m : array of shape (B, 10)
        Moments of x^i y^j about the optical axis, up to the third order.
    Lm : array of shape (B, 10, 6)
        Their interaction matrices.
    centre, mu, R : arrays of shape (2, B), (10, B) and (10, 6, B)
        The results; rows 1 and 2 of R are the rates of the centre.
    """
    for b in range(len(m)):
        x, y = m[b, 1] / m[b, 0], m[b, 2] / m[b, 0]
        centre[0, b], centre[1, b] = x, y
        for k in range(ORDER_3):
            mu[k, b] = 0.0 if k in (1, 2) else shift_moment(m[b], k, x, y)
        for c in range(6):
            column = Lm[b, :, c]
            R[0, c, b] = column[0]
            R[1, c, b] = (column[1] - x * column[0]) / m[b, 0]
            R[2, c, b] = (column[2] - y * column[0]) / m[b, 0]
            for k in range(3, ORDER_3):
                i, j = moment_powers(k)
                rate = shift_moment(column, k, x, y)
                if i > 0:
                    rate -= i * mu[moment_index(i - 1, j), b] * R[1, c, b]
                if j > 0:
                    rate -= j * mu[moment_index(i, j - 1), b] * R[2, c, b]
                R[k, c, b] = rate
