"""Stages: the compiled parts of a step, performed one after the other on a block of runs.

A stage is a function of the block w, the step number, and whole numbers such as row indices. It is
compiled as a function (p, w, step); the array p holds these whole numbers. All stages share this
machine-level signature. Each stage is therefore compiled once, independently of the scene, and a
program of stages is a list of addresses.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from robsim.kernels.machine.block_io import gather_rows, scatter_rows
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.signature import StageSignature

SIGNATURE = (types.CPointer(types.int64), types.CPointer(types.float64), types.int64)
_WHOLE, _REAL = ir.IntType(64), ir.DoubleType()
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
        if not self._address:
            compiled: Any = kernel(self._plain(), address=True)
            with global_compiler_lock:  # defers Ctrl-C until compilation ends
                compiled.compile(SIGNATURE)
                overload = compiled.overloads[SIGNATURE]
                wrapper = overload.fndesc.llvm_cfunc_wrapper_name
                self._address = overload.library.get_pointer_to_function(wrapper)
        return self._address

    def _plain(self) -> Callable[..., Any]:
        """Return the stage as a function (p, w, step)."""
        function = self.function
        if is_plain_stage(function):
            return function
        namespace: dict[str, Any] = {"body": part(function), "rest": _numbers_from}
        exec(self.signature.wrapper, namespace)
        wrapper: Any = namespace["wrapper"]
        own = function.__code__
        wrapper.__code__ = wrapper.__code__.replace(
            co_filename=own.co_filename, co_firstlineno=own.co_firstlineno, co_name=own.co_name
        )
        wrapper.__module__, wrapper.__qualname__ = function.__module__, function.__qualname__
        return wrapper  # type: ignore[no-any-return]

    def link(self) -> None:
        """Register the stage's symbol and address with LLVM."""
        binding.add_symbol(self.symbol, self.address)


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


@intrinsic
def _numbers_from(typing: Any, p: Any, at: Any) -> Any:
    """Return the whole numbers from p[at] on."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.gep(args[0], [args[1]])

    return p(p, at), emit


@intrinsic
def _call_stage(typing: Any, address: Any, p: Any, at: Any, w: Any, first: Any, step: Any) -> Any:
    """Call the stage at an address with p[at:] and w[first:]."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address, p, at, w, first, step = args
        numbers = builder.gep(make_array(sig.args[1])(context, builder, p).data, [at])
        block = builder.gep(make_array(sig.args[3])(context, builder, w).data, [first])
        kinds = [_WHOLE.as_pointer(), _REAL.as_pointer(), _WHOLE]
        kind = ir.FunctionType(ir.VoidType(), kinds).as_pointer()
        builder.call(builder.inttoptr(address, kind), [numbers, block, step])
        return context.get_dummy_value()

    return types.void(address, p, at, w, first, step), emit


@kernel
def perform_on_block(addresses, at, p, block, step):
    """Perform stages on one block for one step."""
    for i in range(addresses.size):
        _call_stage(addresses[i], p, at[i], block, 0, step)


@kernel
def perform_stages(addresses, at, p, blocks, step):
    """Perform stages on each block blocks[i, :] for one step."""
    count, size = blocks.shape
    flat = blocks.reshape(-1)
    group = _group_size(size)
    for first in range(0, count, group):
        for i in range(addresses.size):
            for block in range(first, min(first + group, count)):
                _call_stage(addresses[i], p, at[i], flat, block * size, step)


@kernel
def advance_blocks(addresses, at, p, skipped, blocks, alive, step, until):
    """Perform stages on each block blocks[i, :] from `step` to `until` - 1.

    Step 0 skips the first `skipped` stages. A block stays unchanged once its row `alive` is zero in
    all runs.
    """
    count, size = blocks.shape
    flat = blocks.reshape(-1)
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
                        _call_stage(addresses[i], p, at[i], flat, block * size, now)


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


@kernel
def evaluate_block(addresses, at, p, block, first, x, output, out):
    """Perform stages for each run of x[i, b] and fill out[j, b].

    The inputs are written to rows that start at `first`, the outputs read from rows that start at
    `output`.
    """
    for b in range(0, x.shape[1], WIDTH):
        gather_rows(x, b, first, block)
        perform_on_block(addresses, at, p, block, 0)
        scatter_rows(block, output, b, out)
