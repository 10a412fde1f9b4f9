"""The constants of a tree in two arrays, because each array that Python gives a kernel costs time.

A named tuple of nine arrays takes longer to be handed over than the tree to be placed.
"""

from typing import Any

import numpy as np

from robsim.kernels.curve import Curves
from robsim.kernels.jit import kernel, part
from robsim.kernels.ties import Ties, Wheels
from robsim.kernels.tree import Joints


def pack(joints: Joints) -> tuple[Any, Any]:
    """Return the read-only arrays (integers, numbers) of all that `joints` holds, for `unpack`."""
    ties, wheels, curves = joints.ties, joints.wheels, joints.curves
    counted = joints.rows, ties.rows, wheels.rows, curves.length, curves.pieces
    head = np.array([*(len(table) for table in counted), joints.ratios], dtype=np.int64)
    tables = head, joints.rows, ties.rows, wheels.rows, curves.first
    integers = np.concatenate([table.ravel() for table in tables])
    tables = joints.place, ties.numbers, wheels.numbers, curves.length, curves.pieces
    numbers = np.concatenate([table.ravel() for table in tables])
    for array in (integers, numbers):
        array.flags.writeable = False
    return integers, numbers


@part
def _table(flat, start, rows, columns):
    return flat[start : start + rows * columns].reshape(rows, columns)


@kernel
def unpack(integers, numbers):
    """Return the Joints that `pack` was given, as views."""
    bodies, ties, wheels, curves, pieces, ratios = integers[:6]
    i = 6
    rows = _table(integers, i, bodies, 7)
    i += rows.size
    tie_rows = _table(integers, i, ties, 5)
    i += tie_rows.size
    wheel_rows = _table(integers, i, wheels, 4)
    i += wheel_rows.size
    first = integers[i : i + curves + 1]
    place = numbers[: bodies * 12].reshape(bodies, 3, 4)
    i = place.size
    tie_numbers = _table(numbers, i, ties, 3)
    i += tie_numbers.size
    wheel_numbers = _table(numbers, i, wheels, 3)
    i += wheel_numbers.size
    length = numbers[i : i + curves]
    rails = Curves(first, length, _table(numbers, i + curves, pieces, 7))
    tied, rolling = Ties(tie_rows, tie_numbers), Wheels(wheel_rows, wheel_numbers)
    return Joints(rows, place, tied, rolling, rails, ratios)
