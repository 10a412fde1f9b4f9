"""Array views of rows and of memory at an address, for use inside stages.

If a program passes the address of an array to a stage, the program keeps the array alive.
"""

from typing import Any

import numba
from numba import types
from numba.extending import intrinsic

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH


def _define_address_cast(kind: Any) -> Any:
    """Return the function that casts an address to a pointer to numbers of a type."""

    @intrinsic
    def function(typing: Any, address: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(sig.return_type))

        return types.CPointer(kind)(address), emit

    return function


_to_real, _to_whole = _define_address_cast(types.float64), _define_address_cast(types.int64)


@part
def reals(address, size):
    """Return the float64 array [size] at an address."""
    return numba.carray(_to_real(address), (size,))


@part
def wholes(address, size):
    """Return the int64 array [size] at an address."""
    return numba.carray(_to_whole(address), (size,))


@kernel
def pointer_of(array):
    """Return the pointer to the numbers of a float64 array."""
    return _to_real(array.ctypes.data)


@intrinsic
def _row_pointer(typing: Any, w: Any, row: Any) -> Any:
    """Return the address of a row of a block."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.int64)
        return builder.gep(args[0], [builder.mul(index, index.type(WIDTH))])

    return w(w, row), emit


@part
def vector(w, row, n):
    """Return rows of a block as an array[n, lane]."""
    return numba.carray(_row_pointer(w, row), (n, WIDTH))


@part
def matrix(w, row, n, m):
    """Return rows of a block as an array[n, m, lane]."""
    return numba.carray(_row_pointer(w, row), (n, m, WIDTH))


@intrinsic
def _as_unsigned(typing: Any, pointer: Any) -> Any:
    kind = types.CPointer(types.uint64)

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(args[0], context.get_value_type(kind))

    return kind(pointer), emit


@part
def unsigned_row(w, row):
    """Return a row that stores the bits of whole numbers as a uint64 array[lane]."""
    return numba.carray(_as_unsigned(_row_pointer(w, row)), (WIDTH,))


@part
def tensor(w, row, n, m, k):
    """Return rows of a block as an array[n, m, k, lane]."""
    return numba.carray(_row_pointer(w, row), (n, m, k, WIDTH))
