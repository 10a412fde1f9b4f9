"""The runs that advance in lockstep, and what is remembered of each from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, format_value
from robsim.kernels.machine.program import Blocks


class Chunk(Blocks):
    """The runs of a chunk that go on: their numbers, and what Python code remembers of them."""

    def keep(self, going: NDArray[np.bool_]) -> None:
        """Go on with some of the runs."""
        self.memory = _select_memory(self.memory, going)
        super().keep(going)


@dataclass(eq=False)
class ChunkProgress:
    """A chunk of runs on its way: these rows of all runs, and the step that comes next."""

    rows: NDArray[np.int64]
    chunk: Chunk | None = None  # before it has begun, and after its end
    step: int = 0
    done: bool = False


def _select_memory(memory: dict[str, Any], going: NDArray[np.bool_]) -> dict[str, Any]:
    """Return what a controller or a user's law remembers of the runs that go on."""
    kept: dict[str, Any] = {}
    for name, value in memory.items():
        if isinstance(value, dict):
            kept[name] = _select_memory(value, going)
        else:
            kept[name] = _check_memory_rows(name, value, going.size)[going]
    return kept


def _check_memory_rows(name: str, value: Any, runs: int) -> NDArray[Any]:
    """Return a remembered array, one row for each run; InputError if it is none."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        array = np.empty(())
    if array.shape[:1] != (runs,):
        raise InputError(
            f"memory {name!r}: expected an array with a row for each of {runs} runs, "
            f"got {format_value(value)}"
        )
    return array
