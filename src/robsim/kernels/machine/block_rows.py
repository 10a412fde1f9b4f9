"""Rows of a block and addresses of arrays: integers with a shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import reduce
from typing import Any


class BlockRows(int):
    """The index of the first of consecutive rows of a block, and the shape of these rows.

    The rows hold an array of this shape in C order.

    >>> points = BlockRows(7, (4, 2))
    >>> points[1], points[2:], points.flat
    (rows 9 to 10, shape (2,), rows 11 to 14, shape (2, 2), rows 7 to 14, shape (8,))
    """

    shape: tuple[int, ...]

    def __new__(cls, first: int, shape: tuple[int, ...] = ()) -> BlockRows:
        return block_rows_at(first, shape)

    def __getitem__(self, where: Any) -> BlockRows:
        """Return the rows of one entry, or of consecutive entries, of the first axis."""
        if where.__class__ is tuple:
            return reduce(BlockRows.__getitem__, where, self)
        try:
            entries = range(self.shape[0])[where]
        except IndexError:
            raise IndexError(f"{self!r} have no entry {where}") from None
        rest = self.shape[1:]
        if where.__class__ is not slice:
            return block_rows_at(self + entries * math.prod(rest), rest)
        if entries.step != 1:
            raise IndexError(f"a slice of rows must have step 1, got {where}")
        return block_rows_at(self + entries.start * math.prod(rest), (len(entries), *rest))

    def __iter__(self) -> Iterator[BlockRows]:
        rest = self.shape[1:]
        step = math.prod(rest)
        return (block_rows_at(self + i * step, rest) for i in range(self.shape[0]))

    @property
    def size(self) -> int:
        """The number of rows."""
        return math.prod(self.shape)

    @property
    def flat(self) -> BlockRows:
        """The same rows with a shape of one axis."""
        return block_rows_at(self, (math.prod(self.shape),))

    @property
    def column(self) -> BlockRows:
        """The same rows as a matrix with one column."""
        return block_rows_at(self, (self.size, 1))

    def reshape(self, *shape: int) -> BlockRows:
        """Return the same rows with another shape. One axis may be -1."""
        if -1 in shape and (rest := -math.prod(shape)):
            shape = tuple(self.size // rest if n == -1 else n for n in shape)
        if math.prod(shape) != self.size:
            raise ValueError(f"{self!r} cannot have the shape {shape}")
        return block_rows_at(self, shape)

    def __repr__(self) -> str:
        first = int(self)
        return f"rows {first} to {first + self.size - 1}, shape {self.shape}"


def block_rows_at(
    first: int, shape: tuple[int, ...], new: Callable[..., BlockRows] = int.__new__
) -> BlockRows:
    """Return `BlockRows(first, shape)` in half the time of a call of the class."""
    self = new(BlockRows, first)
    self.shape = shape
    return self


class Address(int):
    """The address of an array's first number, and the shape of the array."""

    shape: tuple[int, ...]

    def __new__(cls, first: int, shape: tuple[int, ...] = ()) -> Address:
        self = int.__new__(cls, first)
        self.shape = shape
        return self
