"""What a controller measures at one instant, and what it remembers until the next."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, first_view, last_view
from robsim.kernels.sight import Projection
from robsim.servo.sight import Key


@dataclass(frozen=True, eq=False)
class Measurement:
    """What the sensors give a controller at one instant of some runs, and its memory.

    `projections` hold the true geometry, for a controller that believes the truth; their depths
    are those of the image.
    """

    step: int
    dt: float
    q: Array  # (nq, B) as measured
    projections: dict[Key, Projection]  # of each camera and its target
    pixels: dict[Key, Array]  # (N, 2, B) as measured
    memory: dict[str, Any]  # arrays with the run first, until the next instant
    hidden: dict[Key, NDArray[np.bool_]] = field(default_factory=dict)  # (N, B), if any mark is
    prompt: bool = True  # whether q and pixels are those of this instant

    @property
    def time(self) -> float:
        """The time in seconds since the start."""
        return self.step * self.dt

    @property
    def runs(self) -> int:
        """The number of runs B."""
        return int(self.q.shape[1])


def remember(memory: dict[str, Any], name: str, array: Array) -> None:
    """Keep an array, whose last axis is the run, in a memory."""
    memory[name] = first_view(array)


def recall(memory: dict[str, Any], name: str) -> Array:
    """Return an array that was kept in a memory, with the run last."""
    return np.ascontiguousarray(last_view(memory[name]))
