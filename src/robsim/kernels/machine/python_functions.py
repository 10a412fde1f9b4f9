"""Functions of Python that are machine code, so a call runs no code in Python.

Python passes the addresses of the arguments to such a function (METH_FASTCALL in the stable part of
Python's C interface). All these functions share one code, `call_entry`. It turns numbers into
words, calls the C function of an entry without the GIL, and returns the results. A record of whole
numbers describes each function. Python's own functions are called by their addresses, so the code
contains no symbol of Python.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from robsim.kernels.machine.array_objects import OBJECT_HEAD, describe_array_types
from robsim.kernels.machine.array_views import cast_address_to
from robsim.kernels.machine.intrinsics import Intrinsic, routine
from robsim.kernels.machine.machine_code import PACKAGE_CODE, find_address

MOST = 128  # arguments or results
KINDS = "array", "int64", "uint64", "float64", "bool"
_ARRAY, _UNSIGNED, _REAL, _BOOL = 0, 2, 3, 4
# A record has the address of the C function, of the types of arrays, of the functions of Python, of
# the counter of failed stages, and of two functions for arguments that do not fit and for failures;
# then the numbers of arguments and of results, and the kind of each of them.
_CODE, _TYPES, _PYTHON, _COUNTER, _OTHERWISE, _FAIL, _COUNT, _RESULTS, _FIRST = range(9)
_FUNCTIONS = (
    *("PyLong_AsLongLong", "PyLong_AsUnsignedLongLong", "PyFloat_AsDouble"),
    *("PyErr_Occurred", "PyErr_Clear", "PyEval_SaveThread", "PyEval_RestoreThread"),
    *("PyObject_Vectorcall", "PyLong_FromLongLong", "PyFloat_FromDouble", "PyBool_FromLong"),
    *("PyTuple_New", "PyTuple_SetItem", "Py_IncRef"),
)
_AS_WHOLE, _AS_UNSIGNED, _AS_REAL, _ERROR, _CLEAR, _RELEASE_LOCK, _TAKE_LOCK = range(7)
_VECTORCALL, _FROM_WHOLE, _FROM_REAL, _FROM_BOOL, _NEW_TUPLE, _SET_ITEM, _ADD_REFERENCE = range(
    7, 14
)
_NONE = 14  # the address of None

_word_at = Intrinsic("array_pointers", "load_word")
_words_at, _numbers_at = cast_address_to("int64"), cast_address_to("float64")
_counts_at = cast_address_to("int32")
_reserve_words = Intrinsic("c_calls", "make_stack_memory", MOST)
_call = Intrinsic("c_calls", "make_c_call", "int64")
_call_for_real = Intrinsic("c_calls", "make_c_call", "float64")


@routine
def _store_argument(python, kind, value, words, numbers, i):
    """Store an argument as a word; return False if Python cannot convert it."""
    if kind == _ARRAY:
        words[i] = value
        return True
    if kind == _REAL:
        numbers[i] = _call_for_real(python[_AS_REAL], (value,))
        is_doubtful = numbers[i] == -1.0
    else:
        convert = python[_AS_UNSIGNED if kind == _UNSIGNED else _AS_WHOLE]
        words[i] = _call(convert, (value,))
        is_doubtful = words[i] == -1
    if is_doubtful and _call(python[_ERROR], ()) != 0:
        _call(python[_CLEAR], ())
        return False
    return True


@routine
def _make_result(python, kind, words, numbers, i):
    """Return the address of a new number of Python."""
    if kind == _REAL:
        return _call(python[_FROM_REAL], (numbers[i],))
    return _call(python[_FROM_BOOL if kind == _BOOL else _FROM_WHOLE], (words[i],))


@routine
def _make_results(python, record, words, numbers):
    """Return the address of None, of a number of Python, or of a tuple of numbers."""
    kinds, count = _FIRST + record[_COUNT], record[_RESULTS]
    if count == 0:
        _call(python[_ADD_REFERENCE], (python[_NONE],))
        return python[_NONE]
    if count == 1:
        return _make_result(python, record[kinds], words, numbers, 0)
    found = _call(python[_NEW_TUPLE], (count,))
    for i in range(count if found != 0 else 0):
        number = _make_result(python, record[kinds + i], words, numbers, i)
        _call(python[_SET_ITEM], (found, i, number))
    return found


@routine
def _perform(record, python, words):
    """Call the C function without the GIL; return its status, 0 if a stage has failed."""
    counts = _counts_at(_word_at(record[_COUNTER]))
    before = counts[0]
    thread = _call(python[_RELEASE_LOCK], ())
    status = _call(record[_CODE], (record[_TYPES], words, words))
    _call(python[_TAKE_LOCK], (thread,))
    return status if counts[0] == before else 0


SYMBOL = f"robsim.{__name__}.call_entry.{OBJECT_HEAD}"


def make_call_entry() -> Callable[..., Any]:
    """Return the code of all functions, for the objects of this Python."""
    head = OBJECT_HEAD  # a part of the key in the cache, as all variables from outside

    def call_entry(this, arguments, count):
        """Call the C function of the record at the address `this`."""
        record, given = _words_at(_word_at(this + head)), _words_at(arguments)
        python, memory = _words_at(record[_PYTHON]), _reserve_words()
        words, numbers = _words_at(memory), _numbers_at(memory)
        fits = count == record[_COUNT]
        for i in range(count if fits else 0):
            kind = record[_FIRST + i]
            fits = fits and _store_argument(python, kind, given[i], words, numbers, i)
        status = _perform(record, python, memory) if fits else 1
        if status == 0:
            return _call(python[_VECTORCALL], (record[_FAIL], 0, 0, 0))
        if status == 1:
            return _call(python[_VECTORCALL], (record[_OTHERWISE], arguments, count, 0))
        return _make_results(python, record, words, numbers)

    return call_entry


class _Method(ctypes.Structure):
    """The fields of PyMethodDef."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("code", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("text", ctypes.c_char_p),
    )


_new_function = ctypes.PYFUNCTYPE(
    ctypes.py_object, ctypes.POINTER(_Method), ctypes.py_object, ctypes.c_void_p
)(("PyCFunction_NewEx", ctypes.pythonapi))
_FASTCALL = 0x80
_array_types = describe_array_types()
_python = np.array(
    [ctypes.cast(getattr(ctypes.pythonapi, each), ctypes.c_void_p).value for each in _FUNCTIONS]
    + [id(None)],
    dtype=np.int64,
)
_kept: list[Any] = []  # objects at the addresses that the functions hold


def build_function(
    name: str,
    address: int,
    kinds: Sequence[str],
    results: Sequence[str],
    otherwise: Callable[..., Any],
    fail: Callable[[], Any],
) -> Callable[..., Any]:
    """Return the function of Python that calls a C function.

    It returns `otherwise(*arguments)` if the arguments do not fit, and `fail()` after a failure.
    """
    addresses = [address, _array_types.ctypes.data, _python.ctypes.data]
    addresses += [ctypes.addressof(PACKAGE_CODE.counter), id(otherwise), id(fail)]
    numbers = map(KINDS.index, [*kinds, *results])
    record = np.array([*addresses, len(kinds), len(results), *numbers], dtype=np.int64)
    method = _Method(name.encode(), _find_call_entry(), _FASTCALL, None)
    _kept.extend([method, otherwise, fail])
    return _new_function(ctypes.byref(method), record, None)  # type: ignore[no-any-return]


@cache
def _find_call_entry() -> int:
    return find_address(SYMBOL, make_call_entry, ("int64",) * 3)
