"""How far reprojected marks are off where noise alone cannot have put them, and where most."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array

FAR = 3.0  # pixels, or times the noise: detectors are wrong by tenths, views mixed up by tens


def rms_of(residuals: Array) -> float:
    """Return the root mean square of residuals of any shape, NaN apart.

    >>> rms_of(np.array([3.0, np.nan, -3.0]))
    3.0
    """
    return float(np.sqrt(np.nanmean(np.square(residuals))))


def misfit(residuals: Array, noise: float) -> str:
    """Return a sentence on residuals (V, N, 2) in pixels that are too large; empty for others.

    Too large is a root mean square above 3 pixels, and above three times the noise, pixels, where
    that is known (0: it is not). NaN stands for marks that are not seen.

    >>> misfit(np.full((3, 4, 2), 0.3), 0.0)
    ''
    >>> misfit(np.array([[[6.0, 8.0]], [[3.0, 4.0]]]), 0.5)[:59]
    'the marks are 5.59 px off (rms), worst in view 0 (7.07 px):'
    """
    rms = rms_of(residuals)
    if rms <= FAR * max(1.0, noise):
        return ""
    each = [rms_of(view) for view in residuals]
    worst = int(np.argmax(each))
    return (
        f"the marks are {rms:.3g} px off (rms), worst in view {worst} ({each[worst]:.3g} px): "
        "swapped columns and rows, another size or order of the marks, or views and joints that "
        "do not belong together?"
    )
