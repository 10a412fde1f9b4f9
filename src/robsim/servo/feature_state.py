"""The features of a task at one instant, and how they move."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.base.arrays import Array


@dataclass(frozen=True, eq=False)
class FeatureState:
    """The features s with L and the Jacobians, as the controller models them, with the run last."""

    s: Array  # (k, B)
    L: Array  # (k, 6, B) for the twist of the first camera, where all cameras move as one
    J: Array  # (6, n, B) of the first camera against its target
    task_jacobian: Array  # (k, n, B) L J, or as learnt by Broyden's rule
