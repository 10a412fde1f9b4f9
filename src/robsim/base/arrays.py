"""Checks and layouts of arrays: runs are the first axis for users, the last for kernels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.errors import InputError, format_value

Array = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)
EXACT_INTEGERS = 2**53  # integers up to this bound are exact as floats
_FLOAT = np.dtype(np.float64)


def as_floats(
    value: ArrayLike, what: str, shape: tuple[int | str, ...], *, gaps: bool = False
) -> Array:
    """Return a finite float64 copy with the last axes in `shape`.

    A word in `shape` stands for any size. With `gaps`, NaN is valid for missing numbers. Raise
    InputError, naming `what`, if the value is not numeric, not finite, or of another shape.
    """
    if type(value) is float and math.isfinite(value) and not shape:
        return np.array(value)  # fast path
    if type(value) is np.ndarray and value.dtype is _FLOAT:
        array = value.copy()
    else:
        array = _convert_to_floats(value, what, shape)
    if array.shape[max(array.ndim - len(shape), 0) :] != shape:
        _check_shape(array, what, shape)
    finite = np.isfinite(array)
    if gaps:
        finite |= np.isnan(array)
    if np.count_nonzero(finite) != array.size:
        index = tuple(int(i) for i in np.argwhere(~finite)[0])
        place = f" at index {index}" if index else ""
        raise InputError(f"{what}: {array[index]}{place}; every number must be finite")
    return array


def is_kernel_array(value: Any, size: int) -> bool:
    """Return whether a value is an array (..., size) that kernels can read without a copy."""
    return (
        type(value) is np.ndarray
        and value.dtype is _FLOAT
        and value.ndim > 0
        and value.shape[-1] == size
        and value.flags.carray
    )


def _convert_to_floats(value: ArrayLike, what: str, shape: tuple[int | str, ...]) -> Array:
    """Return a float64 copy; InputError unless the value is numeric."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "iufO" or (array.dtype.kind == "O" and None in array.ravel()):
            raise TypeError("texts, truth values, dates and None are not numbers")
        return np.array(value, dtype=np.float64, order="C")  # the layout of compiled kernels
    except MemoryError:
        raise
    except Exception:  # noqa: BLE001  a conversion runs code of the value
        kind = f"numbers of shape {_format_shape(shape)}" if shape else "a number"
        raise InputError(f"{what}: expected {kind}, got {format_value(value)}") from None


def _check_shape(array: Array, what: str, shape: tuple[int | str, ...]) -> None:
    """Raise InputError unless the last axes have `shape`; a name such as "n" fits any size."""
    tail = array.shape[array.ndim - len(shape) :] if array.ndim >= len(shape) else None
    if tail is None or any(
        isinstance(n, int) and n != size for n, size in zip(shape, tail, strict=True)
    ):
        raise InputError(f"{what}: expected shape {_format_shape(shape)}, got {array.shape}")


def _format_shape(shape: tuple[int | str, ...]) -> str:
    return "(..., " + ", ".join(map(str, shape)) + ")"


def make_read_only(array: NDArray[T]) -> NDArray[T]:
    """Return the array itself, set to read-only."""
    array.flags.writeable = False
    return array


def move_runs_last(array: NDArray[T], axes: int) -> NDArray[T]:
    """Return an array (..., a, b) with `axes` trailing axes as a contiguous array (a, b, run).

    The result is writable, because kernels are compiled for writable arrays.
    """
    lead, tail = array.shape[: array.ndim - axes], array.shape[array.ndim - axes :]
    flat = array.reshape(math.prod(lead), *tail)
    return np.require(flat.transpose(*range(1, flat.ndim), 0), requirements=["C", "W"])


def move_runs_first(array: NDArray[T], lead: tuple[int, ...] = (-1,)) -> NDArray[T]:
    """Return an array (a, b, run) as a contiguous array (*lead, a, b)."""
    first = np.ascontiguousarray(array.transpose(-1, *range(array.ndim - 1)))
    return first.reshape(*lead, *array.shape[:-1])


def align_runs(*arrays: Array, axes: int) -> list[Array]:
    """Return arrays with `axes` axes; if one has the runs as a further, last axis, all have it."""
    most = max(array.ndim for array in arrays)
    return [array[..., None] if array.ndim == axes < most else array for array in arrays]


def scale_runs(values: Array, factor: float | Array, axes: int) -> Array:
    """Return values with `axes` axes times a factor, or times one for each run (last axis)."""
    if np.ndim(factor) and values.ndim == axes:
        values = values[..., None]
    result: Array = values * factor
    return result


def has_items(value: object) -> bool:
    """Return whether a value has items; a text or an array without axes has none."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Iterable) and not isinstance(value, str)


def is_any_nonzero(value: Any) -> bool:
    """Return whether a number, or any number of an array, is nonzero; fast for numbers."""
    return bool(value) if isinstance(value, float | int) else bool(np.any(value))


def select_runs(array: NDArray[T], chosen: NDArray[Any]) -> NDArray[T]:
    """Return a contiguous copy (..., some) of chosen runs, for an array with the run last."""
    return np.ascontiguousarray(array[..., chosen])


def euclidean_length(array: Array) -> Array:
    """Return the Euclidean norm over the first axis, summed term by term.

    The order of the terms is fixed, so that the bits do not depend on the number of runs.
    """
    square = np.zeros(array.shape[1:])
    for row in array:
        square += row * row
    return np.asarray(np.sqrt(square))


_RUN_FIRST = [tuple(np.roll(range(n), 1).tolist()) for n in range(5)]
_RUN_LAST = [tuple(np.roll(range(n), -1).tolist()) for n in range(5)]


def view_runs_first(array: NDArray[T]) -> NDArray[T]:
    """Return a view (run, a, b) of an array (a, b, run)."""
    return array.transpose(_RUN_FIRST[array.ndim])


def view_for_user(array: NDArray[T]) -> NDArray[T]:
    """Return a read-only view (run, a, b) of an array (a, b, run), for users."""
    return make_read_only(view_runs_first(array))


def view_runs_last(array: NDArray[T]) -> NDArray[T]:
    """Return a view (a, b, run) of an array (run, a, b); contiguous if that is a view of one."""
    return array.transpose(_RUN_LAST[array.ndim])


def as_one_or_each(
    value: ArrayLike, what: str, owner: str, *, zero: bool = False
) -> float | tuple[float, ...]:
    """Return one positive number for all owners, or a tuple with one for each.

    With `zero`, 0 is valid too. InputError names `what` and the owner.
    """
    array = as_floats(value, what, ())
    fits = (array >= 0 if zero else array > 0).all()
    if array.ndim > 1 or not array.size or not fits:
        kind = "number not below 0" if zero else "positive number"
        raise InputError(
            f"{what} must be a {kind}, or one for each {owner}, got {format_value(array.tolist())}"
        )
    return tuple(array.tolist()) if array.ndim else float(array)


def as_float(value: ArrayLike, what: str) -> float:
    """Return a finite number; InputError, naming `what`, for other values."""
    array = as_floats(value, what, ())
    if array.ndim:
        raise InputError(f"{what}: expected a number, got {format_value(value)}")
    return float(array)


def as_positive(value: ArrayLike, what: str) -> float:
    """Return a finite positive number; InputError, naming `what`, for other values."""
    if type(value) is float and 0.0 < value < math.inf:
        return value
    array = as_floats(value, what, ())
    if array.ndim or not array > 0:
        raise InputError(f"{what} must be a positive number, got {format_value(value)}")
    return float(array)


def as_nonnegative(value: ArrayLike, what: str) -> float:
    """Return a finite number of at least zero; InputError, naming `what`, for other values."""
    array = as_floats(value, what, ())
    if array.ndim or array < 0:
        raise InputError(f"{what} must be a number not below 0, got {format_value(value)}")
    return float(array)


def as_integer(value: ArrayLike, what: str, low: int, below: int | None = None) -> int:
    """Return an integer of at least `low`; InputError, naming `what`, for other values."""
    if type(value) is int and low <= value < (
        EXACT_INTEGERS if below is None else min(below, EXACT_INTEGERS)
    ):
        return value  # fast path
    array = as_floats(value, what, ())
    if isinstance(value, bool) or array.ndim or array != np.round(array) or array < low:
        raise InputError(f"{what} must be a whole number from {low} on, got {format_value(value)}")
    whole = int(cast(int, value))  # exact, also above 2**53
    if below is not None and whole >= below:
        raise InputError(f"{what} must be below {below}, got {format_value(value)}")
    return whole


def as_bool(value: object, what: str) -> bool:
    """Return a truth value; InputError, naming `what`, for other values."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what} must be True or False, got {format_value(value)}")
    return bool(value)
