"""Stages: the compiled parts of a step, called one after the other on a block of runs.

A stage is a function `stage(p, w, step)` of whole numbers p, which say where things stand, of the
block w, and of the number of the step. All have one signature, so that each is compiled once and
alone, for any scene, and a program of them is a list of addresses.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from robsim.kernels.machine.block import gather_rows, scatter_rows
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH

SIGNATURE = (types.CPointer(types.int64), types.CPointer(types.float64), types.int64)
_WHOLE, _REAL = ir.IntType(64), ir.DoubleType()


class Stage:
    """A compiled part of a step, which is compiled when its address is first asked for."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name = function.__qualname__
        self.symbol = f"robsim.{function.__module__}.{self.name}"
        self._compiled: Any = kernel(function, address=True)
        self._address = 0

    @property
    def address(self) -> int:
        """The address of the machine code."""
        if not self._address:
            if not hasattr(self._compiled, "compile"):
                raise RuntimeError("kernels need Numba's compiler: unset NUMBA_DISABLE_JIT")
            with global_compiler_lock:  # for Ctrl-C to wait until all is done
                self._compiled.compile(SIGNATURE)
                made = self._compiled.overloads[SIGNATURE]
                wrapper = made.fndesc.llvm_cfunc_wrapper_name
                self._address = made.library.get_pointer_to_function(wrapper)
        return self._address

    def link(self) -> None:
        """Let machine code find it by its symbol."""
        binding.add_symbol(self.symbol, self.address)


def stage(function: Callable[..., Any]) -> Stage:
    """Return a function of (p, w, step) as a stage."""
    return Stage(function)


@intrinsic
def _call(typing: Any, address: Any, p: Any, at: Any, w: Any, first: Any, step: Any) -> Any:
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
def perform_on(addresses, at, p, block, step):
    """Perform stages on one block, one step."""
    for i in range(addresses.size):
        _call(addresses[i], p, at[i], block, 0, step)


@kernel
def perform(addresses, at, p, blocks, step):
    """Perform stages on each of some blocks[i, :], one step."""
    size = blocks.shape[1]
    flat = blocks.reshape(-1)
    for block in range(blocks.shape[0]):
        for i in range(addresses.size):
            _call(addresses[i], p, at[i], flat, block * size, step)


@kernel
def advance(addresses, at, p, skipped, blocks, alive, step, until):
    """Perform stages on each of some blocks[i, :], from `step` until before a later one.

    At the start, step 0, the first ones are skipped. A block of which no run is alive any more, as
    its row `alive` says, is left as it is.
    """
    size = blocks.shape[1]
    flat = blocks.reshape(-1)
    for block in range(blocks.shape[0]):
        for now in range(step, until):
            if not _any(blocks[block], alive):
                break
            for i in range(skipped if now == 0 else 0, addresses.size):
                _call(addresses[i], p, at[i], flat, block * size, now)


@part
def _any(block, row):
    alive = False
    for lane in range(WIDTH):
        alive |= block[row * WIDTH + lane] != 0.0
    return alive


@kernel
def evaluate(addresses, at, p, block, first, x, found, out):
    """Perform stages for each run of x[i, b], which go to rows from `first`; fill out[j, b]."""
    for b in range(0, x.shape[1], WIDTH):
        gather_rows(x, b, first, block)
        perform_on(addresses, at, p, block, 0)
        scatter_rows(block, found, b, out)
