"""The runs that advance in lockstep, and what is remembered of each from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, some_runs
from robsim.base.errors import InputError
from robsim.kernels.endings import Watch
from robsim.kernels.loop import Noise
from robsim.run.images import ImageStream


@dataclass
class Chunk:
    """The active runs of a chunk: their state, and what is remembered of them."""

    rows: NDArray[np.int64]
    q: Array
    rates: Array  # (nv, B) velocities of the joints
    noise: Noise
    images: ImageStream
    watch: Watch
    near: NDArray[np.int64]  # (B,) instants in a row at which the run seemed to have converged
    memory: dict[str, Any]  # of the controller, run first

    def without(self, over: NDArray[np.bool_]) -> Chunk:
        """Return the chunk of the runs that go on when some are over."""
        noise = self.noise._replace(runs=self.noise.runs[~over])
        watch = Watch(*(some_runs(array, ~over) for array in self.watch))
        memory = _remembered(self.memory, ~over)
        q, rates = some_runs(self.q, ~over), some_runs(self.rates, ~over)
        images = self.images.without(over)
        near = self.near[~over]
        return Chunk(self.rows[~over], q, rates, noise, images, watch, near, memory)


def _remembered(memory: dict[str, Any], going: NDArray[np.bool_]) -> dict[str, Any]:
    """Return what a controller or a user's law remembers of the runs that go on."""
    kept: dict[str, Any] = {}
    for name, value in memory.items():
        if isinstance(value, dict):
            kept[name] = _remembered(value, going)
        else:
            kept[name] = _rows(name, value, going.size)[going]
    return kept


def _rows(name: str, value: Any, runs: int) -> NDArray[Any]:
    """Return a remembered array, one row for each run; InputError if it is none."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        array = np.empty(())
    if array.shape[:1] != (runs,):
        raise InputError(
            f"memory {name!r}: expected an array with a row for each of {runs} runs, "
            f"got {value!r:.80}"
        )
    return array
