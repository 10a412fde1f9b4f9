"""Chunks: runs that advance in lockstep, and their memory from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, format_value
from robsim.kernels.machine.program import Blocks


class Chunk(Blocks):
    """The running runs of a chunk: their numbers, and the memory of Python code."""

    def keep(self, going: NDArray[np.bool_]) -> None:
        """Keep only some of the runs."""
        self.memory = _select_memory(self.memory, going)
        super().keep(going)


@dataclass(eq=False)
class ChunkProgress:
    """The progress of a chunk: its rows of all runs, its state, and its next step."""

    rows: NDArray[np.int64]
    chunk: Chunk | None = None  # None before the first step and after the last
    step: int = 0
    done: bool = False


def _select_memory(memory: dict[str, Any], going: NDArray[np.bool_]) -> dict[str, Any]:
    """Return the memory of a controller or a user's law, of the running runs only."""
    selected: dict[str, Any] = {}
    for name, value in memory.items():
        if isinstance(value, dict):
            selected[name] = _select_memory(value, going)
        else:
            selected[name] = _check_memory_rows(name, value, going.size)[going]
    return selected


def _check_memory_rows(name: str, value: Any, runs: int) -> NDArray[Any]:
    """Return an array of the memory, one row for each run; InputError for another shape."""
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
