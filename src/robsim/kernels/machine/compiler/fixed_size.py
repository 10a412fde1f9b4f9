"""Kernels for fixed sizes: straight-line code that keeps its temporary numbers in registers.

The Python code of a kernel is executed on symbols instead of lanes while LLVM code is generated.
Loops and temporary rows disappear. The operations and their order remain, so the results have the
same bits as the general kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from robsim.kernels.machine import lanes
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import Kernel

_REALS = ir.VectorType(ir.DoubleType(), lanes.WIDTH)
_WHOLE = ir.IntType(64)


class _Symbol:
    """Lanes that an instruction computes. The first use of the value emits the instruction."""

    def __init__(self, builder: Any, emit: Callable[[], Any]) -> None:
        self._builder, self._emit = builder, emit
        self._value: Any = None

    @property
    def value(self) -> Any:
        """The LLVM value, emitted once."""
        if self._value is None:
            self._value = self._emit()
        return self._value

    def _with(self, instruction: str, *operands: Any) -> _Symbol:
        """Return the result of an instruction with symbols or numbers as operands."""
        result = getattr(self._builder, instruction)(*map(_llvm_value, operands))
        return _Symbol(self._builder, lambda: result)

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
        symbol = f"llvm.sqrt.v{lanes.WIDTH}f64"
        function = self._builder.module.declare_intrinsic(
            symbol, (), ir.FunctionType(_REALS, [_REALS])
        )
        return self._with("call", function, [self.value])


def _llvm_value(operand: Any) -> Any:
    """Return the LLVM value of a symbol or a number. Return any other operand unchanged."""
    if isinstance(operand, float):
        return ir.Constant(_REALS, [operand] * lanes.WIDTH)
    return operand.value if isinstance(operand, _Symbol) else operand


class _MemoryRow:
    """A row of the block in memory. Its index is known only when the machine code runs."""

    def __init__(self, builder: Any, first: Any, row: int = 0) -> None:
        self.builder, self.first, self.row = builder, first, row

    def __add__(self, rows: int) -> _MemoryRow:
        return _MemoryRow(self.builder, self.first, self.row + rows)

    def address(self) -> Any:
        """Return the address of the row's lanes."""
        at = self.builder.gep(self.first, [ir.Constant(_WHOLE, self.row * lanes.WIDTH)])
        return self.builder.bitcast(at, _REALS.as_pointer())


def _get_symbol(own: dict[int, Any], row: Any) -> Any:
    """Return a row in memory, or a temporary row of the kernel."""
    if not isinstance(row, _MemoryRow):
        return own[row]

    def emit() -> Any:
        read = row.builder.load(row.address())
        read.align = 8
        return read

    return _Symbol(row.builder, emit)


def _put_symbol(own: dict[int, Any], row: Any, x: Any) -> None:
    """Write a row in memory, or a temporary row of the kernel."""
    if isinstance(row, _MemoryRow):
        row.builder.store(_llvm_value(x), row.address()).align = 8
    else:
        own[row] = x


_OPERATIONS = {id(lanes.get): _get_symbol, id(lanes.put): _put_symbol, id(lanes.sqrt): _Symbol.sqrt}


def _make_symbolic(function: Any) -> Any:
    """Return a kernel as a function of symbols, together with its callees."""
    if id(function) in _OPERATIONS:
        return _OPERATIONS[id(function)]
    if isinstance(function, Intrinsic) and function.name == "make_routine":
        plain = function.arguments[0]
    elif isinstance(function, Kernel):
        plain = function.py_func
    else:
        return function
    namespace = {name: _make_symbolic(plain.__globals__[name]) for name in _global_names(plain)}
    return FunctionType(plain.__code__, namespace)


def _global_names(plain: Any) -> list[str]:
    """Return the global names that a Python function uses."""
    return [name for name in plain.__code__.co_names if name in plain.__globals__]


def make_unrolled_kernel(kernel: Any, places: tuple[int, ...], sizes: dict[int, int]) -> Any:
    """Return a function (p, w) that performs kernel(p, w) for fixed entries of p.

    `sizes` maps indices of p to the fixed entries. `places` are the indices of p that hold rows in
    memory. All other rows of the kernel are temporary and must have fixed indices.
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
