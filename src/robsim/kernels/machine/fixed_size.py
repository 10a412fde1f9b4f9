"""Kernels for sizes that are known beforehand: one long line of code, with numbers in registers.

The Python of a kernel is carried out while its code is made, on symbols instead of lanes: loops
and rows of its own vanish, and what is left are operations in the same order, so the bits are
those of the kernel as compiled for any sizes.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from robsim.kernels.machine import lanes

_REALS = ir.VectorType(ir.DoubleType(), lanes.WIDTH)
_WHOLE = ir.IntType(64)


class _Symbol:
    """Lanes that an instruction will compute, which is written down when it is first needed."""

    def __init__(self, builder: Any, emit: Callable[[], Any]) -> None:
        self._builder, self._emit = builder, emit
        self._value: Any = None

    @property
    def value(self) -> Any:
        """The value in LLVM's code, written down once."""
        if self._value is None:
            self._value = self._emit()
        return self._value

    def _with(self, instruction: str, *operands: Any) -> _Symbol:
        """Return what an instruction computes from symbols or numbers."""
        made = getattr(self._builder, instruction)(*map(_llvm_value, operands))
        return _Symbol(self._builder, lambda: made)

    def __add__(self, other: Any) -> _Symbol:
        return self._with("fadd", self, other)

    def __sub__(self, other: Any) -> _Symbol:
        return self._with("fsub", self, other)

    def __mul__(self, other: Any) -> _Symbol:
        return self._with("fmul", self, other)

    def __rmul__(self, other: Any) -> _Symbol:
        return self._with("fmul", other, self)

    def __rtruediv__(self, other: Any) -> _Symbol:
        return self._with("fdiv", other, self)

    def __neg__(self) -> _Symbol:
        return self._with("fneg", self)

    def sqrt(self) -> _Symbol:
        """Return the symbol of the square root of these lanes."""
        known = f"llvm.sqrt.v{lanes.WIDTH}f64"
        function = self._builder.module.declare_intrinsic(
            known, (), ir.FunctionType(_REALS, [_REALS])
        )
        return self._with("call", function, [self.value])


def _llvm_value(operand: Any) -> Any:
    """Return a symbol's value, a number as lanes, and all else as it is."""
    if isinstance(operand, float):
        return ir.Constant(_REALS, [operand] * lanes.WIDTH)
    return operand.value if isinstance(operand, _Symbol) else operand


class _MemoryRow:
    """A row of the block in memory, of which only the machine knows the number."""

    def __init__(self, builder: Any, first: Any, row: int = 0) -> None:
        self.builder, self.first, self.row = builder, first, row

    def __add__(self, rows: int) -> _MemoryRow:
        return _MemoryRow(self.builder, self.first, self.row + rows)

    def address(self) -> Any:
        """Return where its lanes stand."""
        at = self.builder.gep(self.first, [ir.Constant(_WHOLE, self.row * lanes.WIDTH)])
        return self.builder.bitcast(at, _REALS.as_pointer())


def _get_symbol(own: dict[int, Any], row: Any) -> Any:
    """Return a row in memory, or one that the kernel has of its own."""
    if not isinstance(row, _MemoryRow):
        return own[row]

    def emit() -> Any:
        read = row.builder.load(row.address())
        read.align = 8
        return read

    return _Symbol(row.builder, emit)


def _put_symbol(own: dict[int, Any], row: Any, x: Any) -> None:
    """Write a row in memory, or one that the kernel has of its own."""
    if isinstance(row, _MemoryRow):
        row.builder.store(_llvm_value(x), row.address()).align = 8
    else:
        own[row] = x


_OPERATIONS = {id(lanes.get): _get_symbol, id(lanes.put): _put_symbol, id(lanes.sqrt): _Symbol.sqrt}


def _make_symbolic(function: Any) -> Any:
    """Return a kernel, and what it calls, as functions of symbols."""
    if id(function) in _OPERATIONS:
        return _OPERATIONS[id(function)]
    if not hasattr(function, "py_func"):
        return function
    plain = function.py_func
    known = {name: _make_symbolic(plain.__globals__[name]) for name in _global_names(plain)}
    return FunctionType(plain.__code__, known)


def _global_names(plain: Any) -> list[str]:
    return [name for name in plain.__code__.co_names if name in plain.__globals__]


def unroll_kernel(kernel: Any, places: tuple[int, ...], sizes: dict[int, int]) -> Any:
    """Return a function (p, w) that performs kernel(p, w) where some of p are known.

    `sizes` are those, by their index; the `places` are indices of rows in memory. All other rows
    that the kernel names are its own, and must be known.
    """
    perform = _make_symbolic(kernel)

    @intrinsic
    def function(typing: Any, p: Any, w: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            numbers: dict[int, Any] = dict(sizes)
            for i in places:
                row = builder.load(builder.gep(args[0], [ir.Constant(_WHOLE, i)]))
                first = builder.mul(row, ir.Constant(_WHOLE, lanes.WIDTH))
                numbers[i] = _MemoryRow(builder, builder.gep(args[1], [first]))
            perform(numbers, {})
            return context.get_dummy_value()

        return types.void(p, w), emit

    return function
