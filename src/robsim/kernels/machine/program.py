"""Programs: ordered stages and the rows of the block that the stages read and write."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from copy import copy
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
    """The numbers of runs that advance in lockstep, stored in blocks of WIDTH runs.

    If fewer than WIDTH runs remain for the last block, copies of the last run fill it.

    Attributes
    ----------
    runs : int
        Number of runs.
    rows : ndarray of shape (runs,)
        Indices of the runs in the program's values.
    numbers : ndarray of shape (blocks, rows, WIDTH)
        Current numbers.
    memory : dict
        Arrays that Python stages keep between steps. Their first axis is the run.
    made : dict
        Values that Python stages computed at the current step.
    """

    def __init__(self, program: Program, runs: NDArray[np.int64]) -> None:
        self.runs, self.rows = len(runs), runs
        self.memory: dict[str, Any] = {}
        self.made: dict[Any, Any] = {}
        self.numbers = _allocate_aligned(-(-len(runs) // WIDTH), program.size)
        same = np.zeros(program.size)  # one assignment for all rows is ten times faster
        for first, values in program.same:
            same[first : first + values.size] = values
        self.flat[:] = np.repeat(same, WIDTH)
        for first, values in program.run_rows:
            self.put(first, values[:, runs])

    @property
    def flat(self) -> Array:
        """The blocks as an array of shape (n, rows * lanes)."""
        count, rows, _ = self.numbers.shape
        return self.numbers.reshape(count, rows * WIDTH)

    def get(self, row: int, *shape: int) -> Array:
        """Return a copy of rows as an array of shape (*shape, runs).

        `row` is a `BlockRows`, or the index of the first row together with a shape.
        """
        if not shape and isinstance(row, BlockRows):
            shape = row.shape
        count = math.prod(shape)
        lanes = self.numbers[:, row : row + count].transpose(1, 0, 2)
        rows = lanes.reshape(count, self.numbers.shape[0] * WIDTH)[:, : self.runs]
        return np.array(rows, order="C").reshape(*shape, self.runs)  # also one number is copied

    def put(self, row: int, values: Array) -> None:
        """Write values of shape (..., runs) to consecutive rows that start at `row`."""
        rows = values.reshape(math.prod(values.shape[:-1]), values.shape[-1])
        left = self.numbers.shape[0] * WIDTH - self.runs
        if left:
            rows = np.concatenate([rows, np.repeat(rows[:, -1:], left, axis=1)], axis=1)
        self._into(row, rows)

    def first(self, rows: BlockRows) -> Array:
        """Return a copy of the first run's numbers, in the shape of the rows."""
        return self.numbers[0, rows : rows + rows.size, 0].reshape(rows.shape).copy()

    def fill(self, row: int, values: Array) -> None:
        """Write values of shape (n,) to n rows that start at `row`, the same for all runs."""
        self.numbers[:, row : row + len(values)] = values[:, None]

    def keep(self, going: NDArray[np.bool_]) -> None:
        """Keep the runs selected by the mask `going` of shape (runs,) and drop all others."""
        rows = self.numbers.shape[1]
        left, self.runs = self.get(0, rows) if going.any() else None, int(going.sum())
        self.rows = self.rows[going]
        self.numbers = _allocate_aligned(-(-self.runs // WIDTH), rows)
        if left is not None:
            self.put(0, left[:, going])

    def _into(self, row: int, lanes: Array) -> None:
        into = self.numbers[:, row : row + len(lanes)]
        into[:] = lanes.reshape(len(lanes), len(into), WIDTH).transpose(1, 0, 2)


PythonStage = Callable[
    [Any, int], None
]  # a Python stage: a function of the blocks and the step number


class PythonFallback(NamedTuple):
    """A Python stage that is needed only if a row is nonzero in some run.

    Attributes
    ----------
    own : callable
        The Python stage.
    row : int
        The row that a compiled stage sets to a nonzero number if Python is needed.
    """

    own: PythonStage
    row: int

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Perform the Python stage."""
        self.own(blocks, step)


class CompiledStages:
    """Consecutive compiled stages, in the arrays that the kernels require."""

    def __init__(self, calls: list[tuple[CompiledStage, Sequence[int]]]) -> None:
        self.addresses = np.array([stage.address for stage, _ in calls], dtype=np.int64)
        sizes = [len(numbers) for _, numbers in calls]
        self.at = np.array([0, *accumulate(sizes)], dtype=np.int64)[: len(calls)]
        flat = array("q", chain.from_iterable(numbers for _, numbers in calls))
        self.numbers = np.array(flat or [0], dtype=np.int64)

    def extend(self, calls: list[tuple[CompiledStage, Sequence[int]]]) -> CompiledStages:
        """Return these stages followed by others."""
        own = CompiledStages(calls)
        own.at = np.concatenate([self.at, own.at + len(self.numbers)])
        own.addresses = np.concatenate([self.addresses, own.addresses])
        own.numbers = np.concatenate([self.numbers, own.numbers])
        return own

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Perform the stages on all blocks."""
        kernels.perform_stages(self.addresses, self.at, self.numbers, blocks.flat, step)


class Program:
    """Ordered stages and the rows that the stages read and write.

    A row holds one number of each run. Its initial value is zero unless `constant` or `each`
    created it.

    Attributes
    ----------
    size : int
        Number of rows.
    calls : list
        Compiled stages with their packed numbers, and Python stages.
    same : list of (int, ndarray)
        First row and initial values that are equal in all runs.
    run_rows : list of (int, ndarray of shape (rows, runs))
        First row and initial values of each run.
    wholes : list of BlockRows
        Rows of whole numbers that stages use as indices of memory.
    referenced_arrays : list
        Arrays that must stay alive, as `calls` contains their addresses.
    """

    def __init__(self) -> None:
        self.size = 0
        self._scratch = BlockRows(0, (0,))
        self.calls: list[tuple[CompiledStage, Sequence[int]] | PythonStage | PythonFallback] = []
        self.same: list[tuple[int, Array]] = []
        self.run_rows: list[tuple[int, Array]] = []
        self.wholes: list[BlockRows] = []
        self.referenced_arrays: list[Any] = []

    def copy(self) -> Program:
        """Return a program to which stages can be added without a change of this one."""
        other = copy(self)
        lists = {name: list(each) for name, each in vars(self).items() if isinstance(each, list)}
        vars(other).update(lists)
        return other

    def join_constants(self) -> None:
        """Store the values that are equal in all runs as one array, which blocks copy faster."""
        column = np.zeros(self.size)
        for first, values in self.same:
            column[first : first + values.size] = values
        self.same = [(0, column)]

    def rows(self, *shape: int) -> BlockRows:
        """Return new rows of a shape, a single row by default."""
        first = self.size
        self.size += math.prod(shape)
        return block_rows_at(first, shape)

    def scratch(self, *shape: int) -> BlockRows:
        """Return rows for temporary values; any stage may overwrite them."""
        if math.prod(shape) > self._scratch.size:
            self._scratch = self.rows(math.prod(shape))
        return BlockRows(self._scratch, shape)

    def constant(self, values: Any) -> BlockRows:
        """Return new rows that start with the same values in all runs."""
        array = np.array(values, dtype=np.float64)
        rows = block_rows_at(self.size, array.shape)
        self.size += array.size
        self.same.append((rows, array.ravel()))
        return rows

    def numbers(self, values: Any, axes: int) -> BlockRows:
        """Return new rows for values with `axes` axes.

        A further, last axis holds the values of each run.
        """
        array = np.asarray(values, dtype=np.float64)
        return self.constant(array) if array.ndim == axes else self.each(array)

    def each(self, values: Any) -> BlockRows:
        """Return new rows for values of shape (..., runs).

        A last axis of length 1 holds the values of all runs.
        """
        array = np.asarray(values, dtype=np.float64)
        *shape, runs = array.shape
        if runs == 1:
            return self.constant(array[..., 0])
        rows = self.rows(*shape)
        self.run_rows.append((rows, array.reshape(-1, runs)))
        return rows

    def number(self, value: Any) -> BlockRows:
        """Return a new row for a scalar, or for values of shape (runs,)."""
        is_one = isinstance(value, float | int | np.integer)
        return self.constant(value) if is_one else self.each(np.asarray(value).reshape(-1))

    @property
    def runs(self) -> int:
        """The number of runs in the values that were passed to `each`, or 1."""
        return max((values.shape[1] for _, values in self.run_rows), default=1)

    def whole(self, values: Any) -> BlockRows:
        """Return a new row for whole numbers of shape (runs,).

        The row stores the bits of each int64 number as a float64.
        """
        self.wholes.append(self.each(np.asarray(values, dtype=np.int64).view(np.float64)))
        return self.wholes[-1]

    def address(self, array: NDArray[Any]) -> Address:
        """Return the address of an array's first number.

        The program holds a reference to the array.
        """
        self.referenced_arrays.append(array)
        return Address(array.ctypes.data, array.shape)

    def add(self, stage: CompiledStage, /, **rows: Any) -> None:
        """Append a stage. Its rows and numbers are passed by name.

        Raise WrongRows if they do not fit the stage's signature.
        """
        self.calls.append((stage, stage.signature.pack(**rows)))

    def result(self, stage: CompiledStage, name: str, /, *shape: int, **rows: Any) -> BlockRows:
        """Append a stage, pass new rows of a shape as its parameter `name`, and return the rows."""
        output = self.rows(*shape)
        self.add(stage, **{name: output}, **rows)
        return output

    def call(self, own: PythonStage) -> None:
        """Append a Python stage, a function of the blocks and the step number."""
        self.calls.append(own)

    def add_python_rows(self, ask: Callable[[Any, int], Array], *shape: int) -> BlockRows:
        """Append a Python stage, write its return value to new rows, and return the rows."""
        output = self.rows(*shape)
        self.call(lambda blocks, step: blocks.put(output, ask(blocks, step)))
        return output

    def rescue(self, own: PythonStage, row: int) -> None:
        """Append a Python stage that is needed only if `row` is nonzero in some run.

        A compiled stage writes the row. A loop that performs only the compiled stages must check
        the row afterwards.
        """
        self.calls.append(PythonFallback(own, row))

    @property
    def stages(self) -> list[tuple[CompiledStage, Sequence[int]]] | None:
        """The compiled stages without the conditional Python stages.

        None if the program has an unconditional Python stage.
        """
        rest = [each for each in self.calls if not isinstance(each, PythonFallback)]
        return rest if all(_is_compiled_call(each) for each in rest) else None  # type: ignore[return-value]

    @property
    def rescues(self) -> list[int]:
        """The rows that are nonzero in the runs that need a Python stage."""
        return [each.row for each in self.calls if isinstance(each, PythonFallback)]

    @property
    def compiled(self) -> bool:
        """Whether all stages are compiled."""
        return all(map(_is_compiled_call, self.calls))

    def segments(self, start: int = 0, end: int | None = None) -> list[PythonStage]:
        """Return the calls from `start` to `end`, with consecutive compiled stages joined."""
        segments: list[PythonStage] = []
        for compiled, group in groupby(self.calls[start:end], _is_compiled_call):
            calls: list[Any] = list(group)
            segments += [CompiledStages(calls)] if compiled else calls
        return segments or [CompiledStages([])]

    def prepared(self) -> tuple[Any, ...]:
        """Return the arguments of a kernel that performs all stages, and an initial block."""
        segment = cast(CompiledStages, self.segments()[0])
        block = Blocks(self, np.zeros(1, dtype=np.int64)).flat[0]
        return segment.addresses, segment.at, segment.numbers, block


class ProgramFunction:
    """A function that writes input rows, performs compiled stages, and returns output rows.

    It holds addresses of machine code, so it is valid in its own process only.
    """

    def __init__(self, program: Program, first: int, output: int, count: int) -> None:
        self.program, self.count = program, count
        self.first, self.output = (
            int(first),
            int(output),
        )  # kernels accept int faster than BlockRows
        self._prepared = program.prepared()

    def __reduce__(self) -> Any:
        raise TypeError("machine code of this process cannot be copied or pickled")

    def __call__(self, x: Array, runs: NDArray[np.int64] | None = None) -> Array:
        """Return output rows of shape (count, B) for input rows x of shape (n, B).

        If the program has values for each run, `runs` of shape (B,) holds the index of each
        column's run. By default column b belongs to run b, and a single column to all runs.
        """
        if self.program.runs > 1:
            return self._of_each(x, np.arange(self.program.runs) if runs is None else runs)
        out, (*stages, block) = np.empty((self.count, x.shape[1])), self._prepared
        own = _allocate_aligned(1, self.program.size).reshape(-1)
        own[:] = block
        kernels.evaluate_block(*stages, own, self.first, x, self.output, out)
        return out

    def _of_each(self, x: Array, runs: NDArray[np.int64]) -> Array:
        blocks = Blocks(self.program, runs)
        blocks.put(self.first, np.broadcast_to(x, (len(x), len(runs))))
        for part in self.program.segments():
            part(blocks, 0)
        return blocks.get(self.output, self.count)


def _is_compiled_call(call: Any) -> bool:
    return type(call) is tuple


def evaluate_stages(
    add: Callable[..., Sequence[BlockRows]],
    arrays: Sequence[Array],
    shapes: Sequence[tuple[int, ...]] | None = None,
    runs: NDArray[np.int64] | None = None,
) -> list[Array]:
    """Return the arrays of shape (*shape, B) that stages compute from other arrays.

    `add(program, *rows)` adds the stages to a new program. Its arguments are the rows of the
    arrays, and it returns the rows of the results. `shapes` replaces the shapes of these rows. If
    the program has values for each run, `runs` of shape (B,) holds the index of each column's run.
    By default the columns are all runs in order.
    """
    program = Program()
    rows = [program.rows(*each.shape[:-1]) for each in arrays]
    outputs = add(program, *rows)
    count = arrays[0].shape[-1]
    if runs is None:
        runs = np.arange(count) if program.runs > 1 else np.zeros(count, dtype=np.int64)
    blocks = Blocks(program, runs)
    for row, values in zip(rows, arrays, strict=True):
        blocks.put(row, values)
    for part in program.segments():
        part(blocks, 0)
    others = [()] * len(outputs) if shapes is None else shapes
    return [blocks.get(row, *shape) for row, shape in zip(outputs, others, strict=True)]


def _allocate_aligned(count: int, rows: int) -> Array:
    """Return an array of shape (count, rows, lanes) that is aligned to vector registers."""
    size, register = count * rows * WIDTH, 8 * WIDTH
    memory = np.empty(size + WIDTH)
    start = -memory.ctypes.data % register // 8
    return memory[start : start + size].reshape(count, rows, WIDTH)
