"""The code of calls of stages by their address or their symbol."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from robsim.kernels.machine.machine_code import link_symbol
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


def make_linked_call(stage: CompiledStage) -> Any:
    """Return the function (w, numbers) that performs a stage, called by its symbol, at step 0."""

    @intrinsic
    def perform(typing: Any, w: Any, numbers: Any) -> Any:
        link_symbol(stage.symbol)  # before the code that calls it

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            p, block = _store_numbers(context, builder, list(sig.args[1]), args[1]), args[0]
            if not isinstance(sig.args[0], types.CPointer):
                block = make_array(sig.args[0])(context, builder, block).data
            called = cgutils.get_or_insert_function(builder.module, _STAGE_TYPE, stage.symbol)
            builder.call(called, [p, block, ir.Constant(_WHOLE, 0)])
            return context.get_dummy_value()

        return types.void(w, numbers), emit

    return perform


@intrinsic
def call_stage(typing: Any, address: Any, p: Any, at: Any, w: Any, first: Any, step: Any) -> Any:
    """Call the stage at an address with p[at:] and w[first:]."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address, p, at, w, first, step = args
        numbers = builder.gep(make_array(sig.args[1])(context, builder, p).data, [at])
        block = builder.gep(make_array(sig.args[3])(context, builder, w).data, [first])
        builder.call(builder.inttoptr(address, _STAGE_TYPE.as_pointer()), [numbers, block, step])
        return context.get_dummy_value()

    return types.void(address, p, at, w, first, step), emit
