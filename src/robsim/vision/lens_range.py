"""The radius around the optical axis within which a lens is monotonic."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from robsim.base.arrays import Array

TINY = 1e-30  # smaller coefficients of the lens polynomial count as zero


def find_valid_radius(lens: Array) -> float:
    """Return the largest normalised radius with monotonic distortion, for eight coefficients.

    The radius is the smallest positive root of d/dr (r N(r^2) / D(r^2)) and of D, with the
    numerator N and the denominator D of the radial distortion. It is infinite without a root.

    >>> round(find_valid_radius(np.array([-0.3, 0, 0, 0, 0, 0, 0, 0])), 4)
    1.0541
    """
    k1, k2, _, _, k3, k4, k5, k6 = lens
    over, under = Polynomial([1, k1, k2, k3]), Polynomial([1, k4, k5, k6])
    t = Polynomial([0, 1])  # r squared
    slope = over * under + 2 * t * (over.deriv() * under - over * under.deriv())
    roots = np.concatenate([slope.trim(TINY).roots(), under.trim(TINY).roots()])
    real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
    return float(np.sqrt(real.min())) if real.size else np.inf
