"""The interaction matrix of any feature: its own, or found by moving the camera a little."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.arrays import Array
from robsim.features.feature import Feature, Observation

STEP = 1e-5  # metres and radians: rounding and truncation both near 1e-10 of L


def interaction(feature: Feature, seen: Observation) -> Any:
    """L (B, k, 6), as the feature gives it or by central differences of what it measures.

    The differences move the believed marks: normalised points at believed depths.
    """
    own = getattr(feature, "interaction", None)
    return differences(feature, seen) if own is None else own(seen)


def differences(feature: Feature, seen: Observation) -> Array:
    """L (B, k, 6) by central differences of `measure` along the six motions of the camera."""
    columns = []
    for axis in range(6):
        ahead, behind = (
            np.asarray(feature.measure(moved(seen, axis, step)), dtype=np.float64)
            for step in (STEP, -STEP)
        )
        columns.append((ahead - behind) / (2.0 * STEP))
    return np.stack(columns, axis=-1)


def moved(seen: Observation, axis: int, step: float) -> Observation:
    """What would be seen had the camera moved by `step` along or about one of its axes."""
    raise NotImplementedError
