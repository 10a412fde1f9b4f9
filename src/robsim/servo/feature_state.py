"""The features of a task at one instant, and how they move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.sight import Projection
from robsim.servo.sight import Key


@dataclass(frozen=True, eq=False)
class FeatureState:
    """The features s with L and the Jacobians, as the controller models them, with the run last."""

    s: Array  # (k, B)
    L: Array  # (k, 6, B) for the twist of the first camera, where all cameras move as one
    J: Array  # (6, n, B) of the first camera against its target
    task_jacobian: Array  # (k, n, B) L J, or as learnt by Broyden's rule
    twists: dict[Key, Array]  # J of every sight
    projections: dict[Key, Projection]  # what is where, as believed
    each: list[Array]  # L (k, 6, B) of every block for its own camera; none if L is a constant
    hidden: NDArray[np.bool_] | None = None  # (k, B) what is not seen now, and left out
