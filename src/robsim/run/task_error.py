"""The error of runs and its norm, from recorded features."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.engine.recorder import RecordedSeries


def make_error_variables(series: RecordedSeries, s_goal: Array) -> dict[str, Array]:
    """Return features, error, norm and Lyapunov function from a record.

    The goal broadcasts with (runs, instants, k). Sums are computed feature by feature, so that
    their bits do not depend on the batch. Features of weight 0 have no error and do not contribute
    to the norm.
    """
    error, weighted = series.s - s_goal, series.weights.shape[-1] > 0
    if weighted:
        error = np.where(series.weights == 0.0, np.nan, error)
    square = np.zeros(error.shape[:2])
    for i in range(error.shape[2]):
        own = error[..., i] ** 2
        square += np.where(series.weights[..., i] == 0.0, 0.0, own) if weighted else own
    return {
        "s": series.s,
        **({"weight": series.weights} if weighted else {}),
        "error": error,
        "error_norm": np.sqrt(square),
        "lyapunov": 0.5 * square,
    }
