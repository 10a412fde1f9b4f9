"""Pointers to numbers in memory, for Numba's arrays."""

from functools import cache
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from robsim.kernels.machine.lanes import WIDTH


@cache
def make_address_cast(kind: str) -> Any:
    """Return the function that casts an address to a pointer to numbers of a type."""
    number = types.boolean if kind == "bool" else getattr(types, kind)

    @intrinsic
    def function(typing: Any, address: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(sig.return_type))

        return types.CPointer(number)(address), emit

    return function


@intrinsic
def carray(typing: Any, pointer: Any, sizes: Any) -> Any:
    """Return the array in C order at an address, with some sizes.

    Numba's own `carray` compiles a function for each type of arrays, and needs its runtime.
    """
    array = types.Array(pointer.dtype, len(sizes), "C")

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        shape = [
            context.cast(builder, size, kind, types.intp)
            for size, kind in zip(cgutils.unpack_tuple(builder, args[1]), sizes, strict=True)
        ]
        made = make_array(array)(context, builder)
        size = context.get_abi_sizeof(context.get_data_type(array.dtype))
        strides = [context.get_constant(types.intp, size)]
        for length in shape[:0:-1]:
            strides.insert(0, builder.mul(strides[0], length))
        populate_array(
            made,
            data=builder.bitcast(args[0], made.data.type),
            shape=shape,
            strides=strides,
            itemsize=strides[-1],
            meminfo=None,
        )
        return made._getvalue()

    return array(pointer, sizes), emit


@intrinsic
def point_to_row(typing: Any, w: Any, row: Any) -> Any:
    """Return the address of a row of a block."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.int64)
        return builder.gep(args[0], [builder.mul(index, index.type(WIDTH))])

    return w(w, row), emit


@intrinsic
def cast_to_unsigned(typing: Any, pointer: Any) -> Any:
    """Return a pointer as a pointer to uint64 numbers."""
    kind = types.CPointer(types.uint64)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(args[0], context.get_value_type(kind))

    return kind(pointer), emit


@intrinsic
def point_to_numbers(typing: Any, p: Any, at: Any) -> Any:
    """Return the address of p[at]."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.gep(args[0], [args[1]])

    return p(p, at), emit


@intrinsic
def load_word(typing: Any, address: Any) -> Any:
    """Return the int64 number at an address."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number = context.get_value_type(types.int64)
        return builder.load(builder.inttoptr(args[0], number.as_pointer()))

    return types.int64(address), emit
