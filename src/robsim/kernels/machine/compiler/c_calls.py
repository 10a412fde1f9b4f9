"""Calls of C functions by their address, and memory on the stack for their arguments."""

from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@cache
def make_c_call(result: str) -> Any:
    """Return the function (address, arguments) that calls a C function.

    The arguments are a tuple of int64 and float64 numbers; addresses are int64 numbers.
    """
    returned = getattr(types, result)

    @intrinsic
    def call(typing: Any, address: Any, arguments: Any) -> Any:
        kinds = [types.float64 if each == types.float64 else types.int64 for each in arguments]

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            values = [
                context.cast(builder, builder.extract_value(args[1], i), given, kind)
                for i, (given, kind) in enumerate(zip(sig.args[1], kinds, strict=True))
            ]
            function = ir.FunctionType(
                context.get_value_type(returned), [context.get_value_type(each) for each in kinds]
            )
            return builder.call(builder.inttoptr(args[0], function.as_pointer()), values)

        return returned(types.int64, arguments), emit

    return call


@cache
def make_stack_memory(size: int) -> Any:
    """Return the function () that returns the address of `size` words on the stack."""

    @intrinsic
    def reserve(typing: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            word = context.get_value_type(types.int64)
            return builder.ptrtoint(cgutils.alloca_once(builder, word, size=size), word)

        return types.int64(), emit

    return reserve
