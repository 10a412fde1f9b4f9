"""The Numba types of lanes and masks, and their operations."""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model
from numba.np.arrayobj import make_array

from robsim.kernels.machine.lanes import WIDTH

_I32 = ir.IntType(32)
_REALS = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


class LanesType(types.Type):
    """The type of WIDTH real numbers."""

    def __init__(self) -> None:
        super().__init__("robsim.Lanes")


class MaskType(types.Type):
    """The type of WIDTH truth values, the results of comparisons."""

    def __init__(self) -> None:
        super().__init__("robsim.Mask")


LANES, MASK = LanesType(), MaskType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _REALS)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


def _broadcast(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a value as lanes: a scalar is copied into every lane."""
    if isinstance(kind, LanesType):
        return value
    number = context.cast(builder, value, kind, types.float64)
    undefined = ir.Constant(_REALS, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(_I32, 0))
    zeros = ir.Constant(ir.VectorType(_I32, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, undefined, zeros)


class _OperatorTemplate(AbstractTemplate):
    """Base of operator templates that Numba resolves before its many own templates."""


_OperatorTemplate.metadata = {"target": "cpu"}  # a more specific target takes precedence


_NUMBER = (LanesType, types.Float, types.Integer)
_PAIRS: list[Any] = [(LanesType, LanesType)]
_PAIRS += [pair for kind in _NUMBER[1:] for pair in ((LanesType, kind), (kind, LanesType))]


def _define_operator(function: Any, result: Any, emit: Any) -> None:
    """Define an operator on two lanes, or on lanes and a scalar: its result type and its code."""

    class ArithmeticTemplate(_OperatorTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            are_numbers = len(args) == 2 and all(isinstance(kind, _NUMBER) for kind in args)
            if are_numbers and any(isinstance(kind, LanesType) for kind in args):
                return signature(result, *args)
            return None

    infer_global(function)(ArithmeticTemplate)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pairs = zip(sig.args, args, strict=True)
        return emit(builder, *(_broadcast(context, builder, *pair) for pair in pairs))

    for pair in _PAIRS:
        lower_builtin(function, *pair)(lower)


for _names, _instruction in (
    (("add", "iadd"), "fadd"),
    (("sub", "isub"), "fsub"),
    (("mul", "imul"), "fmul"),
    (("truediv", "itruediv"), "fdiv"),
):
    for _name in _names:
        _define_operator(
            getattr(operator, _name),
            LANES,
            lambda builder, a, b, how=_instruction: getattr(builder, how)(a, b),
        )
for _name, _symbol in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "==")):
    _define_operator(
        getattr(operator, _name),
        MASK,
        lambda builder, a, b, how=_symbol: builder.fcmp_ordered(how, a, b),
    )


@infer_global(operator.neg)
class _NegativeTemplate(_OperatorTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(LANES, LANES) if isinstance(args[0], LanesType) else None


@lower_builtin(operator.neg, LanesType)
def _lower_negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.fneg(args[0])


def _define_function(name: str, count: int) -> Any:
    """Return the function that applies an LLVM intrinsic of `count` arguments to every lane.

    It takes lanes, or numbers without lanes.
    """

    def apply(*kinds: Any) -> Any:
        kind = LANES if any(isinstance(each, LanesType) for each in kinds) else types.float64

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            real = _REALS if kind is LANES else ir.DoubleType()
            declared = ir.FunctionType(real, [real] * count)
            symbol = f"llvm.{name}.{f'v{WIDTH}f64' if kind is LANES else 'f64'}"
            function = cgutils.get_or_insert_function(builder.module, declared, symbol)
            if kind is LANES:
                pairs = zip(kinds, args, strict=True)
                args = [_broadcast(context, builder, *pair) for pair in pairs]
            return builder.call(function, list(args))

        return kind(*(kinds if kind is LANES else [kind] * count)), emit

    def unary(typing: Any, x: Any) -> Any:
        return apply(x)

    def binary(typing: Any, x: Any, y: Any) -> Any:
        return apply(x, y)

    return intrinsic(unary if count == 1 else binary)


sqrt, absolute = _define_function("sqrt", 1), _define_function("fabs", 1)
floor, copy_sign = _define_function("floor", 1), _define_function("copysign", 2)


def _define_mask_operator(function: Any, instruction: str) -> None:
    """Define an operator on two masks by an LLVM instruction."""

    class MaskTemplate(_OperatorTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            masks = len(args) == 2 and all(isinstance(kind, MaskType) for kind in args)
            return signature(MASK, MASK, MASK) if masks else None

    infer_global(function)(MaskTemplate)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, instruction)(*args)

    lower_builtin(function, MaskType, MaskType)(lower)


_define_mask_operator(operator.and_, "and_")
_define_mask_operator(operator.or_, "or_")


@infer_global(operator.invert)
class _NotTemplate(_OperatorTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(MASK, MASK) if isinstance(args[0], MaskType) else None


@lower_builtin(operator.invert, MaskType)
def _lower_not(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.not_(args[0])


@intrinsic
def where(typing: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return lanes of `a` if the mask is true, else lanes of `b`. Both may be scalars.

    A truth value instead of a mask chooses one of two numbers.
    """
    if isinstance(mask, types.Boolean):
        return types.float64(mask, types.float64, types.float64), _emit_select

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        _, *kinds = sig.args
        chosen = (_broadcast(context, builder, *p) for p in zip(kinds, args[1:], strict=True))
        return builder.select(args[0], *chosen)

    return LANES(MASK, a, b), emit


def _emit_select(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.select(*args)


@intrinsic
def any_lane(typing: Any, mask: Any) -> Any:
    """Return whether a mask is true in any lane."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(MASK), emit


@intrinsic
def least_lane(typing: Any, x: Any) -> Any:
    """Return the index of the first lane with the least number."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        kind, bits = ir.DoubleType(), ir.IntType(WIDTH)
        symbol = f"llvm.vector.reduce.fmin.v{WIDTH}f64"
        reduce = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(kind, [_REALS]), symbol
        )
        least = _broadcast(context, builder, types.float64, builder.call(reduce, [args[0]]))
        mask = builder.bitcast(builder.fcmp_ordered("==", args[0], least), bits)
        last = builder.or_(mask, ir.Constant(bits, 1 << (WIDTH - 1)))  # lanes may be NaN
        return builder.zext(builder.cttz(last, ir.Constant(ir.IntType(1), 1)), ir.IntType(64))

    return types.int64(x), emit


def _row_address(context: Any, builder: Any, kinds: Any, block: Any, row: Any) -> Any:
    """Return the address of a row. The block is an array or a pointer to its first number."""
    pointer = isinstance(kinds[0], types.CPointer)
    data = block if pointer else make_array(kinds[0])(context, builder, block).data
    index = context.cast(builder, row, kinds[1], types.int64)
    first = builder.gep(data, [builder.mul(index, ir.Constant(ir.IntType(64), WIDTH))])
    return builder.bitcast(first, _REALS.as_pointer())


@intrinsic
def get(typing: Any, block: Any, row: Any) -> Any:
    """Return a row of a block[rows * WIDTH] as lanes."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        read = builder.load(_row_address(context, builder, sig.args, *args))
        read.align = 8
        return read

    return LANES(block, row), emit


@intrinsic
def put(typing: Any, block: Any, row: Any, x: Any) -> Any:
    """Write lanes, or a scalar, to a row of a block[rows * WIDTH]."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = _broadcast(context, builder, sig.args[2], args[2])
        written = builder.store(value, _row_address(context, builder, sig.args[:2], *args[:2]))
        written.align = 8
        return context.get_dummy_value()

    return types.void(block, row, x), emit


@intrinsic
def fill_lanes(typing: Any, x: Any) -> Any:
    """Return lanes that all hold a scalar."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _broadcast(context, builder, sig.args[0], args[0])

    return LANES(x), emit


@intrinsic
def get_lane(typing: Any, x: Any, i: Any) -> Any:
    """Return the number in lane i."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.int32)
        return builder.extract_element(args[0], index)

    return types.float64(x, i), emit


@intrinsic
def replace_lane(typing: Any, x: Any, i: Any, value: Any) -> Any:
    """Return a copy of lanes with another number in lane i."""

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        index = context.cast(builder, args[1], sig.args[1], types.int32)
        number = context.cast(builder, args[2], sig.args[2], types.float64)
        return builder.insert_element(args[0], number, index)

    return LANES(x, i, value), emit


@intrinsic
def align_stack(typing: Any) -> Any:
    """Align the stack of the calling function for spilled vector registers.

    LLVM aligns the stack of a function only if a variable on it requires the alignment.
    """

    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        aligned = cgutils.alloca_once(builder, _REALS)
        aligned.align = 8 * WIDTH
        kind = ir.FunctionType(ir.VoidType(), [aligned.type])
        builder.asm(kind, "", "r", [aligned], side_effect=True)
        return context.get_dummy_value()

    return types.void(), emit
