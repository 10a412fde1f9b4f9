"""Programs: stages in their order, and the rows of the block on which they work."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from itertools import accumulate, chain, groupby
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from robsim.kernels.machine import stages as kernels
from robsim.kernels.machine.block_rows import Address, BlockRows, block_rows_at
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.stages import CompiledStage

Array = NDArray[np.float64]


class Blocks:
    """The numbers of some runs that go in lockstep: blocks of a few runs, and rows in each.

    Where fewer runs than lanes are left for the last block, the last run fills it.
    """

    def __init__(self, program: Program, runs: NDArray[np.int64]) -> None:
        self.runs, self.rows = len(runs), runs
        self.memory: dict[str, Any] = {}  # what stages in Python keep, arrays with the run first
        self.made: dict[Any, Any] = {}  # what stages in Python made at this step
        self.numbers = _allocate_aligned(-(-len(runs) // WIDTH), program.size)
        same = np.zeros(program.size)  # at once, as a row at a time takes ten times as long
        for first, values in program.same:
            same[first : first + values.size] = values
        self.flat[:] = np.repeat(same, WIDTH)
        for first, values in program.given:
            self.put(first, values[:, runs])

    @property
    def flat(self) -> Array:
        """The blocks (n, rows * lanes)."""
        count, rows, _ = self.numbers.shape
        return self.numbers.reshape(count, rows * WIDTH)

    def get(self, row: int, *shape: int) -> Array:
        """Return a copy (*shape, runs) of rows, or of others in a shape from the first."""
        if not shape and isinstance(row, BlockRows):
            shape = row.shape
        count = math.prod(shape)
        lanes = self.numbers[:, row : row + count].transpose(1, 0, 2)
        rows = lanes.reshape(count, self.numbers.shape[0] * WIDTH)[:, : self.runs]
        return np.ascontiguousarray(rows).reshape(*shape, self.runs)

    def put(self, row: int, values: Array) -> None:
        """Write values (..., runs) to rows from the first."""
        rows = values.reshape(math.prod(values.shape[:-1]), values.shape[-1])
        left = self.numbers.shape[0] * WIDTH - self.runs
        if left:
            rows = np.concatenate([rows, np.repeat(rows[:, -1:], left, axis=1)], axis=1)
        self._into(row, rows)

    def first(self, rows: BlockRows) -> Array:
        """Return a copy of rows, in their shape, of the first run."""
        return self.numbers[0, rows : rows + rows.size, 0].reshape(rows.shape).copy()

    def fill(self, row: int, values: Array) -> None:
        """Write numbers (n,), the same for all runs, to rows from the first."""
        self.numbers[:, row : row + len(values)] = values[:, None]

    def keep(self, going: NDArray[np.bool_]) -> None:
        """Go on with some of the runs (runs,)."""
        rows = self.numbers.shape[1]
        left, self.runs = self.get(0, rows) if going.any() else None, int(going.sum())
        self.rows = self.rows[going]
        self.numbers = _allocate_aligned(-(-self.runs // WIDTH), rows)
        if left is not None:
            self.put(0, left[:, going])

    def _into(self, row: int, lanes: Array) -> None:
        into = self.numbers[:, row : row + len(lanes)]
        into[:] = lanes.reshape(len(lanes), len(into), WIDTH).transpose(1, 0, 2)


PythonStage = Callable[[Any, int], None]  # a stage in Python, of blocks and the number of the step


class PythonFallback(NamedTuple):
    """A stage in Python that has nothing to do but where a row says so, of any run."""

    own: PythonStage
    row: int

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Perform the stage in Python."""
        self.own(blocks, step)


class CompiledStages:
    """Stages that follow one another, as the kernels take them."""

    def __init__(self, calls: list[tuple[CompiledStage, Sequence[int]]]) -> None:
        self.addresses = np.array([stage.address for stage, _ in calls], dtype=np.int64)
        sizes = [len(numbers) for _, numbers in calls]
        self.at = np.array([0, *accumulate(sizes)], dtype=np.int64)[: len(calls)]
        flat = array("q", chain.from_iterable(numbers for _, numbers in calls))
        self.numbers = np.array(flat or [0], dtype=np.int64)

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Perform the stages on all blocks."""
        kernels.perform_stages(self.addresses, self.at, self.numbers, blocks.flat, step)


class Program:
    """Stages in their order, and the rows that they read and write.

    A row holds one number of each run. It begins as zero, or as `constant` or `each` say.
    """

    def __init__(self) -> None:
        self.size = 0
        self._scratch = BlockRows(0, (0,))
        self.calls: list[tuple[CompiledStage, Sequence[int]] | PythonStage | PythonFallback] = []
        self.same: list[tuple[int, Array]] = []  # first rows, and what begins there in all runs
        self.given: list[tuple[int, Array]] = []  # (rows, runs)
        self.wholes: list[
            BlockRows
        ] = []  # rows of whole numbers, by which stages find places in memory
        self.kept: list[Any] = []  # whose addresses stand among the numbers

    def rows(self, *shape: int) -> BlockRows:
        """Return new rows of a shape, a single one by default."""
        first = self.size
        self.size += math.prod(shape)
        return block_rows_at(first, shape)

    def scratch(self, *shape: int) -> BlockRows:
        """Return rows of a shape in which any stage may work, but where none keeps."""
        if math.prod(shape) > self._scratch.size:
            self._scratch = self.rows(math.prod(shape))
        return BlockRows(self._scratch, shape)

    def constant(self, values: Any) -> BlockRows:
        """Return the rows of numbers that are the same in all runs."""
        given = np.array(values, dtype=np.float64)
        found = block_rows_at(self.size, given.shape)
        self.size += given.size
        self.same.append((found, given.ravel()))
        return found

    def numbers(self, values: Any, axes: int) -> BlockRows:
        """Return the rows of numbers with so many axes, and a last one of runs if they vary."""
        given = np.asarray(values, dtype=np.float64)
        return self.constant(given) if given.ndim == axes else self.each(given)

    def each(self, values: Any) -> BlockRows:
        """Return the rows of numbers (..., runs), of each run its own.

        One column stands for all runs.
        """
        given = np.asarray(values, dtype=np.float64)
        *shape, runs = given.shape
        if runs == 1:
            return self.constant(given[..., 0])
        found = self.rows(*shape)
        self.given.append((found, given.reshape(-1, runs)))
        return found

    def number(self, value: Any) -> BlockRows:
        """Return the row of a number, the same in all runs or (runs,) of each its own."""
        is_one = isinstance(value, float | int | np.integer)
        return self.constant(value) if is_one else self.each(np.asarray(value).reshape(-1))

    @property
    def runs(self) -> int:
        """The number of runs of which each has numbers of its own, or 1."""
        return max((values.shape[1] for _, values in self.given), default=1)

    def whole(self, values: Any) -> BlockRows:
        """Return the row of whole numbers (runs,), which stand there bit by bit."""
        self.wholes.append(self.each(np.asarray(values, dtype=np.int64).view(np.float64)))
        return self.wholes[-1]

    def address(self, array: NDArray[Any]) -> Address:
        """Return the address of the first number of an array, which is kept as long as this."""
        self.kept.append(array)
        return Address(array.ctypes.data, array.shape)

    def add(self, stage: CompiledStage, /, **rows: Any) -> None:
        """Let a stage come next, with what it takes by name; WrongRows if that does not fit."""
        self.calls.append((stage, stage.signature.pack(**rows)))

    def result(self, stage: CompiledStage, name: str, /, *shape: int, **rows: Any) -> BlockRows:
        """Let a stage come next that fills new rows of a shape, under a name; return the rows."""
        found = self.rows(*shape)
        self.add(stage, **{name: found}, **rows)
        return found

    def call(self, own: PythonStage) -> None:
        """Let a function in Python come next, which is given the chunk and the step."""
        self.calls.append(own)

    def asked(self, ask: Callable[[Any, int], Array], *shape: int) -> BlockRows:
        """Let a function in Python come next whose values fill new rows; return the rows."""
        found = self.rows(*shape)
        self.call(lambda blocks, step: blocks.put(found, ask(blocks, step)))
        return found

    def rescue(self, own: PythonStage, row: int) -> None:
        """Let a function in Python come next, which is needed where a row is not zero only.

        A stage writes that row: who performs the others alone looks at it afterwards.
        """
        self.calls.append(PythonFallback(own, row))

    @property
    def stages(self) -> list[tuple[CompiledStage, Sequence[int]]] | None:
        """The stages, without what may be needed in Python; None if some always is."""
        rest = [each for each in self.calls if not isinstance(each, PythonFallback)]
        return rest if all(_is_compiled_call(each) for each in rest) else None  # type: ignore[return-value]

    @property
    def rescues(self) -> list[int]:
        """The rows that say where Python is needed."""
        return [each.row for each in self.calls if isinstance(each, PythonFallback)]

    @property
    def compiled(self) -> bool:
        """Whether all stages are compiled."""
        return all(map(_is_compiled_call, self.calls))

    def segments(self, start: int = 0, end: int | None = None) -> list[PythonStage]:
        """Return some of the calls, with stages that follow one another put together."""
        found: list[PythonStage] = []
        for compiled, group in groupby(self.calls[start:end], _is_compiled_call):
            calls: list[Any] = list(group)
            found += [CompiledStages(calls)] if compiled else calls
        return found or [CompiledStages([])]

    def prepared(self) -> tuple[Any, ...]:
        """Return what a kernel needs to perform all stages, and a block to begin with."""
        made = cast(CompiledStages, self.segments()[0])
        block = Blocks(self, np.zeros(1, dtype=np.int64)).flat[0]
        return made.addresses, made.at, made.numbers, block


class ProgramFunction:
    """A program of compiled stages as a function from some rows to others.

    It holds addresses of machine code, so it cannot leave its process.
    """

    def __init__(self, program: Program, first: int, found: int, count: int) -> None:
        self.program, self.count = program, count
        self.first, self.found = int(first), int(found)  # which kernels take faster than rows
        self._prepared = program.prepared()

    def __reduce__(self) -> Any:
        raise TypeError("machine code of this process cannot be copied or pickled")

    def __call__(self, x: Array, runs: NDArray[np.int64] | None = None) -> Array:
        """Return rows (count, B) with rows x (n, B) from the first.

        Where each run has numbers of its own, `runs` (B,) says whose each column is; by default
        the columns are those of the runs, or one column serves them all.
        """
        if self.program.runs > 1:
            return self._of_each(x, np.arange(self.program.runs) if runs is None else runs)
        out, (*stages, block) = np.empty((self.count, x.shape[1])), self._prepared
        own = _allocate_aligned(1, self.program.size).reshape(-1)
        own[:] = block
        kernels.evaluate_block(*stages, own, self.first, x, self.found, out)
        return out

    def _of_each(self, x: Array, runs: NDArray[np.int64]) -> Array:
        blocks = Blocks(self.program, runs)
        blocks.put(self.first, np.broadcast_to(x, (len(x), len(runs))))
        for part in self.program.segments():
            part(blocks, 0)
        return blocks.get(self.found, self.count)


def _is_compiled_call(call: Any) -> bool:
    return type(call) is tuple


def evaluated(
    add: Callable[..., Sequence[BlockRows]],
    arrays: Sequence[Array],
    shapes: Sequence[tuple[int, ...]] | None = None,
    runs: NDArray[np.int64] | None = None,
) -> list[Array]:
    """Return arrays (*shape, B) that stages compute from others, all with the run last.

    `add(program, *rows)` adds the stages, given the first rows of the arrays, and returns the
    first rows of the results, whose shapes are those of the rows unless others are given. Where
    each run has numbers of its own, `runs` (B,) says whose the arrays are; by default all come in
    order.
    """
    program = Program()
    rows = [program.rows(*each.shape[:-1]) for each in arrays]
    found = add(program, *rows)
    count = arrays[0].shape[-1]
    if runs is None:
        runs = np.arange(count) if program.runs > 1 else np.zeros(count, dtype=np.int64)
    blocks = Blocks(program, runs)
    for row, values in zip(rows, arrays, strict=True):
        blocks.put(row, values)
    for part in program.segments():
        part(blocks, 0)
    others = [()] * len(found) if shapes is None else shapes
    return [blocks.get(row, *shape) for row, shape in zip(found, others, strict=True)]


def _allocate_aligned(count: int, rows: int) -> Array:
    """Return an array (count, rows, lanes) at an address that whole registers can be read from."""
    size, register = count * rows * WIDTH, 8 * WIDTH
    memory = np.empty(size + WIDTH)
    start = -memory.ctypes.data % register // 8
    return memory[start : start + size].reshape(count, rows, WIDTH)
