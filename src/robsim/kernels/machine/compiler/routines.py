"""Kernels that only kernels call: their code is optimised once, in their caller.

Numba optimises a kernel and makes its machine code even if only other kernels call it, and LLVM
optimises its code again in each caller. The code of a routine goes to the caller as it is. Its
types are found apart from its caller, which is faster than the inlining by Numba: the time for the
types of a function grows faster than its length. A routine does not count references to arrays,
each of which is an atomic operation, so it cannot allocate arrays: Numba refuses to compile it.
"""

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite.binding
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags, compile_internal
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.extending import intrinsic

OPTIONS = {"nopython": True, "error_model": "numpy"}  # without fast-math, as all kernels
SWITCHES = {"no_compile": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "nrt": False}
HASH = hash(Flags())


class RoutineFlags(Flags):
    """Options of a routine. Numba compares them for each operator of a routine."""

    def __hash__(self) -> int:
        return HASH  # Numba's own is the same for all options, and computed each time

    def __eq__(self, other: object) -> bool:
        if other is self:
            return True
        if isinstance(other, RoutineFlags):
            return bool(self._values == other._values)
        return bool(super().__eq__(other))


class RoutineLibrary(JITCodeLibrary):
    """The code of a routine, which its caller optimises."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Skip the optimisation, which the caller does for its whole module."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


def make_routine(function: Callable[..., Any], inline: bool) -> Any:
    """Return the function that calls a routine, which it compiles for each list of types."""
    compiled: dict[tuple[Any, ...], Any] = {}

    def call(typing: Any, *args: Any) -> Any:
        kinds = tuple(types.unliteral(each) for each in args)
        if kinds not in compiled:
            compiled[kinds] = _compile_routine(function, kinds, inline)
        done = compiled[kinds]

        def emit(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            context.active_code_library.add_linking_library(done.library)
            cast = [
                context.cast(builder, value, given, kind)
                for value, given, kind in zip(values, args, kinds, strict=True)
            ]
            return context.call_internal(builder, done.fndesc, done.signature, cast)

        return done.signature.return_type(*args), emit

    own = inspect.signature(function)
    typing = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    parameters = [typing, *own.parameters.values()]
    call.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
    return intrinsic(call)


@cache
def _can_inline() -> bool:
    """Return whether LLVM takes the attribute that inlines a function.

    LLVMlite before 0.45 puts it on the returned value, which LLVM refuses. LLVM then inlines as it
    sees fit.
    """
    module = llvmlite.binding.parse_assembly("define void @f() { ret void }")
    module.get_function("f").add_function_attribute("alwaysinline")
    try:
        module.verify()
    except RuntimeError:
        return False
    return True


def _compile_routine(function: Callable[..., Any], args: tuple[Any, ...], inline: bool) -> Any:
    """Return the compiled routine for some types of arguments."""
    context, flags = cpu_target.target_context, RoutineFlags()
    cpu_target.options.parse_as_flags(flags, OPTIONS)
    for name, value in SWITCHES.items():
        setattr(flags, name, value)
    library = RoutineLibrary(context.codegen(), function.__qualname__)
    with global_compiler_lock:
        typing = cpu_target.typing_context
        done = compile_internal(typing, context, library, function, args, None, flags, {})
    if inline and _can_inline():
        library.get_function(done.fndesc.llvm_func_name).add_function_attribute("alwaysinline")
    return done
