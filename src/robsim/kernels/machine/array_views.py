"""Array views of rows and of memory at an address, for use inside stages.

If a program passes the address of an array to a stage, the program keeps the array alive.
"""

from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH

carray = Intrinsic("array_pointers", "carray")
_row_pointer = Intrinsic("array_pointers", "point_to_row")
_as_unsigned = Intrinsic("array_pointers", "cast_to_unsigned")


def cast_address_to(kind: str) -> Intrinsic:
    """Return the function that casts an address to a pointer to numbers, such as "float64"."""
    return Intrinsic("array_pointers", "make_address_cast", kind)


_to_real, _to_whole = cast_address_to("float64"), cast_address_to("int64")
_to_byte = cast_address_to("uint8")


@part
def reals(address, size):
    """Return the float64 array [size] at an address."""
    return carray(_to_real(address), (size,))


@part
def real_matrix(address, n, m):
    """Return the float64 array [n, m] at an address."""
    return carray(_to_real(address), (n, m))


@part
def wholes(address, size):
    """Return the int64 array [size] at an address."""
    return carray(_to_whole(address), (size,))


@kernel
def pointer_of(array):
    """Return the pointer to the numbers of a float64 array."""
    return _to_real(array.ctypes.data)


@part
def as_bytes(array):
    """Return a uint8 array in C order as an array of one axis."""
    return carray(_to_byte(array.ctypes.data), (array.size,))


@part
def as_matrix(array, n, m):
    """Return a float64 array in C order as an array [n, m]."""
    return carray(pointer_of(array), (n, m))


@part
def vector(w, row, n):
    """Return rows of a block as an array[n, lane]."""
    return carray(_row_pointer(w, row), (n, WIDTH))


@part
def matrix(w, row, n, m):
    """Return rows of a block as an array[n, m, lane]."""
    return carray(_row_pointer(w, row), (n, m, WIDTH))


@part
def unsigned_row(w, row):
    """Return a row that stores the bits of whole numbers as a uint64 array[lane]."""
    return carray(_as_unsigned(_row_pointer(w, row)), (WIDTH,))


@part
def tensor(w, row, n, m, k):
    """Return rows of a block as an array[n, m, k, lane]."""
    return carray(_row_pointer(w, row), (n, m, k, WIDTH))
