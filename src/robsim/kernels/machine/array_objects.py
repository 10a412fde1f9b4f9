"""The fields of NumPy's arrays, read by machine code at the address of the Python object.

After the head of an object follow (see `PyArrayObject_fields` in NumPy's C interface) the address
of the numbers, the number of axes, the addresses of the shape and of the strides, the base, the
address of the element type, and flags. `types` is the address of the numbers of
`describe_array_types`.
"""

from typing import Any

import numpy as np

from robsim.kernels.machine.argument_types import DTYPES
from robsim.kernels.machine.intrinsics import Intrinsic, routine

_DATA, _AXES, _SHAPE, _DTYPE, _FLAGS = 0, 8, 16, 40, 48  # bytes after the head
_ORDERED = 0x101  # flags of an array in C order whose numbers are aligned
_WRITABLE = 0x400  # flag of an array that is not read-only
_word_at = Intrinsic("array_pointers", "load_word")
OBJECT_HEAD = object.__basicsize__  # bytes before NumPy's fields; the last 8 point to the type


def describe_array_types() -> Any:
    """Return the numbers that describe arrays to machine code.

    They are the size of the head of an object, and the addresses of the type of arrays and of the
    element types.
    """
    found = [OBJECT_HEAD, id(np.ndarray), *(id(np.dtype(each)) for each in DTYPES)]
    return np.array(found, dtype=np.int64)


@routine
def data_address(types, array):
    """Return the address of the first number of an array."""
    return _word_at(array + _word_at(types) + _DATA)


@routine
def axis_size(types, array, axis):
    """Return the length of an axis of an array."""
    return _word_at(_word_at(array + _word_at(types) + _SHAPE) + 8 * axis)


@routine
def is_array(types, array, element, axes):
    """Return whether an object is an array in C order, of an element type and a number of axes."""
    head = _word_at(types)
    if _word_at(array + head - 8) != _word_at(types + 8):
        return False
    first = array + head
    if _word_at(first + _DTYPE) != _word_at(types + 8 * element):
        return False
    if _word_at(first + _AXES) & 0xFFFFFFFF != axes:
        return False
    return _word_at(first + _FLAGS) & _ORDERED == _ORDERED


@routine
def is_writable_array(types, array, element, axes):
    """Return whether an object is such an array, and not read-only."""
    if not is_array(types, array, element, axes):
        return False
    return _word_at(array + _word_at(types) + _FLAGS) & _WRITABLE != 0
