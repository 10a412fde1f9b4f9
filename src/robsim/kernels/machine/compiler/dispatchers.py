"""The compilation of kernels, stages and entries by Numba."""

import gc
from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.extending import typeof_impl

from robsim.kernels.machine.compiler.cache import KernelCache
from robsim.kernels.machine.compiler.compile_notice import NOTICE
from robsim.kernels.machine.deferred_interrupt import DEFERRED_INTERRUPT
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import Kernel


class CollectorPause(event.Listener):
    """A listener to Numba's events that disables the collector during compilation.

    It saves a sixth of the compilation time. Numba compiles under one lock, so two threads never
    call the listener at the same time.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._was_enabled = False

    def on_start(self, occurrence: Any) -> None:
        """Disable the collector when the outermost kernel starts."""
        if not self._depth:
            self._was_enabled = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, occurrence: Any) -> None:
        """Restore the state of the collector after the outermost kernel."""
        self._depth -= 1
        if not self._depth and self._was_enabled:
            gc.enable()


class InterruptListener(event.Listener):
    """A listener to Numba's events that defers Ctrl-C."""

    def on_start(self, occurrence: Any) -> None:
        """Defer it from the start of a compilation."""
        DEFERRED_INTERRUPT.__enter__()

    def on_end(self, occurrence: Any) -> None:
        """Let it act at the end of the outermost compilation."""
        DEFERRED_INTERRUPT.__exit__()


for _listener in (NOTICE, CollectorPause()):
    event.register("numba:compile", _listener)
event.register("numba:compiler_lock", InterruptListener())  # Numba holds this lock for loading, too


@typeof_impl.register(Kernel)
def _find_kernel_type(value: Kernel, context: Any) -> Any:
    return types.Dispatcher(value.dispatcher)


@typeof_impl.register(Intrinsic)
def _find_intrinsic_type(value: Intrinsic, context: Any) -> Any:
    typing, function = cpu_target.typing_context, value.function
    typing.refresh()  # the definition may be new
    return typing.resolve_value_type(function)


def make_dispatcher(function: Callable[..., Any], inline: str, **options: bool) -> Any:
    """Return Numba's dispatcher of a function. Its machine code is cached on disk."""
    every: dict[str, Any] = {"nogil": True, "error_model": "numpy", "inline": inline, **options}
    compiled: Any = numba.njit(**every)(function)
    compiled._cache = KernelCache(function)
    return compiled


def compile_c_function(function: Callable[..., Any], kinds: tuple[str, ...]) -> int:
    """Return the address of the machine code of a function, which C can call."""
    with global_compiler_lock:  # defers Ctrl-C until compilation ends
        overload = compile_overload(function, kinds)
        wrapper = overload.fndesc.llvm_cfunc_wrapper_name
        return overload.library.get_pointer_to_function(wrapper)  # type: ignore[no-any-return]


def compile_overload(function: Callable[..., Any], kinds: tuple[str, ...]) -> Any:
    """Return Numba's code of a function for arguments of some kinds, with a wrapper for C.

    A kind is a type of numbers, such as "int64", or "float64*" for a pointer to them.
    """
    compiled = make_dispatcher(function, "never", no_cpython_wrapper=True, no_cfunc_wrapper=False)
    signature = tuple(map(_find_type, kinds))
    compiled.compile(signature)
    return compiled.overloads[signature]


def _find_type(kind: str) -> Any:
    number = getattr(types, kind.removesuffix("*"))
    return types.CPointer(number) if kind.endswith("*") else number
