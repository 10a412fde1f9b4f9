"""Stages: the compiled parts of a step, performed one after the other on a block of runs.

A stage is a function of the block w, the step number, and whole numbers such as row indices. It is
compiled as a function (p, w, step); the array p holds these whole numbers. All stages share this
machine-level signature. Each stage is therefore compiled once, independently of the scene, and a
program of stages is a list of addresses.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

from robsim.kernels.machine.block_io import gather_rows, scatter_rows
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import kernel, name_like, part
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.machine_code import find_address
from robsim.kernels.machine.signature import StageSignature

KINDS = ("int64*", "float64*", "int64")  # of the arguments (p, w, step)
_numbers_from = Intrinsic("array_pointers", "point_to_numbers")
_call_stage = Intrinsic("linked_calls", "call_stage")
# The code of all stages exceeds the instruction cache, so each stage acts on a group of blocks
# before the next stage. A group has 4 blocks at most, and 384 KiB at most to fit the second cache.
_GROUP, _GROUP_NUMBERS = 4, 3 << 14


class CompiledStage:
    """A compiled part of a step. The first use of `address` compiles it."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name = function.__qualname__
        self.symbol = f"robsim.{function.__module__}.{self.name}"
        self.function = function
        self._address = 0

    @cached_property
    def signature(self) -> StageSignature:
        """The declared parameters of the stage."""
        return StageSignature(self.name, self.function)

    @property
    def address(self) -> int:
        """The address of the machine code."""
        return self._address or self._find_address()

    def _find_address(self) -> int:
        self._address = find_address(self.symbol, self.make_wrapper, KINDS)
        return self._address

    def make_wrapper(self) -> Callable[..., Any]:
        """Return the stage as a function (p, w, step)."""
        function = self.function
        if is_plain_stage(function):
            return function
        namespace: dict[str, Any] = {"body": part(function), "rest": _numbers_from}
        exec(self.signature.wrapper, namespace)
        return name_like(function, namespace["wrapper"])  # type: ignore[no-any-return]


def stage(function: Callable[..., Any]) -> CompiledStage:
    """Return a function (w, step, ...) as a stage.

    The defaults of the further parameters declare the stage's rows and numbers, see
    `robsim.kernels.machine.signature`. A stage that only other kernels call by its symbol is a
    function (p, w, step) of whole numbers p.
    """
    return CompiledStage(function)


def is_plain_stage(function: Callable[..., Any]) -> bool:
    """Return whether a stage is a function (p, w, step)."""
    return function.__code__.co_argcount == 3 and not function.__defaults__


@kernel
def perform_on_block(addresses, at, p, block, step):
    """Perform stages on one block for one step."""
    for i in range(addresses.size):
        _call_stage(addresses[i], p, at[i], block, 0, step)


@entry("int64[::1], int64[::1], int64[::1], out float64[:, ::1], int64")
def perform_stages(addresses, at, p, blocks, step):
    """Perform stages on each block blocks[i, :] for one step."""
    count, size = blocks.shape
    group = _group_size(size)
    for first in range(0, count, group):
        for i in range(addresses.size):
            for block in range(first, min(first + group, count)):
                _call_stage(addresses[i], p, at[i], blocks, block * size, step)


@entry("int64[::1], int64[::1], int64[::1], int64, out float64[:, ::1], int64, int64, int64")
def advance_blocks(addresses, at, p, skipped, blocks, alive, step, until):
    """Perform stages on each block blocks[i, :] from `step` to `until` - 1.

    Step 0 skips the first `skipped` stages. A block stays unchanged once its row `alive` is zero in
    all runs.
    """
    count, size = blocks.shape
    group = _group_size(size)
    for first in range(0, count, group):
        last = min(first + group, count)
        for now in range(step, until):
            going = _going_blocks(blocks[first:last], alive)
            if not going:
                break
            for i in range(skipped if now == 0 else 0, addresses.size):
                for block in range(first, last):
                    if going >> (block - first) & 1:
                        _call_stage(addresses[i], p, at[i], blocks, block * size, now)


@part
def _group_size(size):
    """Return the number of blocks of so many numbers that a group has."""
    return min(max(_GROUP_NUMBERS // size, 1), _GROUP)


@part
def _going_blocks(blocks, alive):
    """Return a whole number with bit i set if the row `alive` of blocks[i, :] is not all zero."""
    going = 0
    for i in range(blocks.shape[0]):
        for lane in range(alive * WIDTH, alive * WIDTH + WIDTH):
            if blocks[i, lane] != 0.0:
                going |= 1 << i
    return going


@entry(
    "int64[::1], int64[::1], int64[::1], out float64[::1], int64, float64[:, ::1], int64, "
    "out float64[:, ::1]"
)
def evaluate_block(addresses, at, p, block, first, x, output, out):
    """Perform stages for each run of x[i, b] and fill out[j, b].

    The inputs are written to rows that start at `first`, the outputs read from rows that start at
    `output`.
    """
    for b in range(0, x.shape[1], WIDTH):
        gather_rows(x, b, first, block)
        perform_on_block(addresses, at, p, block, 0)
        scatter_rows(block, output, b, out)
