"""States and commands of a single run at all its instants, which take the place of the runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.value import construct_unchecked
from robsim.engine.chunk import Chunk
from robsim.engine.chunk_state import ChunkState
from robsim.engine.loop import Loop
from robsim.kernels.machine.lanes import WIDTH
from robsim.servo.command import Decision
from robsim.servo.laws.control_state import ControlState

WINDOW = 32 * WIDTH  # instants whose numbers are copied before their states are computed

T = TypeVar("T")
JoinArrays = Callable[[Sequence[Any]], Array]


class RunHistory(NamedTuple):
    """States and decisions of a single run; the last axis of their arrays is the instant."""

    state: ChunkState
    decision: Decision

    @property
    def length(self) -> int:
        """The number of instants."""
        return int(self.state.q.shape[-1])


class HistoryRecorder:
    """Recorder of the history of the single run of a loop, step by step.

    The numbers of several instants fill the lanes of one block of rows, so that their states are
    computed together. No state depends on how many are computed together.
    """

    def __init__(self, loop: Loop) -> None:
        self._sequence = loop.sequence
        self._blocks = Chunk(loop.sequence.program, np.zeros(WINDOW, dtype=np.int64))
        self._count = 0  # of the instants in the blocks
        self._parts: list[RunHistory] = []

    def store(self, chunk: Chunk) -> None:
        """Store the present instant of a chunk of one run."""
        block, lane = divmod(self._count, WIDTH)
        self._blocks.numbers[block, :, lane] = chunk.numbers[0, :, 0]
        self._count += 1
        if self._count == WINDOW:
            self._compute_states()

    def history(self) -> RunHistory:
        """Return the history of all stored instants."""
        if self._count:
            self._compute_states()
        history: RunHistory = _map_arrays(
            lambda arrays: np.concatenate(arrays, axis=-1), self._parts
        )
        return history

    def _compute_states(self) -> None:
        """Compute the states of the instants in the blocks."""
        blocks, count = self._blocks, self._count
        blocks.runs, blocks.rows, self._count = count, np.zeros(count, dtype=np.int64), 0
        state, decision = self._sequence.snapshot(blocks), self._sequence.decision(blocks)
        self._parts.append(RunHistory(state, decision))


def select_instants(value: T, instants: NDArray[np.integer[Any]]) -> T:
    """Return the states, decisions or inputs of a law at some instants, given by their indices."""
    selected: T = _map_arrays(
        lambda arrays: np.ascontiguousarray(arrays[0][..., instants]), [value]
    )
    return selected


def _map_arrays(join: JoinArrays, values: Sequence[Any]) -> Any:
    """Return a value with the structure of each of `values`, whose arrays are joined from theirs.

    Parts that are no arrays are the same in all values.
    """
    first = values[0]
    if isinstance(first, np.ndarray):
        return join(values)
    if isinstance(first, ControlState):
        joined = _map_arrays(join, [_turn_gain(vars(each)) for each in values])
        return construct_unchecked(ControlState, **_turn_gain(joined))
    if isinstance(first, dict):
        return {name: _map_arrays(join, [each[name] for each in values]) for name in first}
    if hasattr(first, "_fields"):  # a NamedTuple
        return type(first)(*(_map_arrays(join, each) for each in zip(*values, strict=True)))
    return first


def _turn_gain(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a control state with the axes of its gain exchanged.

    An array of gains has the run first, other arrays last.
    """
    gain = fields["gain"]
    return {**fields, "gain": gain.T if isinstance(gain, np.ndarray) else gain}
