"""Calls of stages from other kernels by a symbol.

Numba copies the code of a callee into its caller, and LLVM optimises this code again in every
caller. Long code with many callers, such as least squares, is therefore compiled once as a stage.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from robsim.kernels.machine.cache import LINKED
from robsim.kernels.machine.stages import CompiledStage

_WHOLE, _REAL = ir.IntType(64), ir.DoubleType()
_STAGE_TYPE = ir.FunctionType(ir.VoidType(), [_WHOLE.as_pointer(), _REAL.as_pointer(), _WHOLE])


def _store_numbers(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    """Store the whole numbers of a tuple on the stack and return their address."""
    first = cgutils.alloca_once(builder, _WHOLE, size=len(kinds))
    for i, kind in enumerate(kinds):
        value = context.cast(builder, builder.extract_value(values, i), kind, types.int64)
        builder.store(value, builder.gep(first, [ir.Constant(_WHOLE, i)]))
    return first


def link_stage(stage: CompiledStage) -> Any:
    """Return a function (w, numbers) that performs a stage at step 0, for calls in kernels."""
    LINKED[stage.symbol] = stage

    @intrinsic
    def perform(typing: Any, w: Any, numbers: Any) -> Any:
        stage.link()  # before the code that calls it

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            p, block = _store_numbers(context, builder, list(sig.args[1]), args[1]), args[0]
            if not isinstance(sig.args[0], types.CPointer):
                block = make_array(sig.args[0])(context, builder, block).data
            called = cgutils.get_or_insert_function(builder.module, _STAGE_TYPE, stage.symbol)
            builder.call(called, [p, block, ir.Constant(_WHOLE, 0)])
            return context.get_dummy_value()

        return types.void(w, numbers), emit

    return perform
