"""The decorators that compile kernels."""

import gc
from collections.abc import Callable
from typing import Any

import numba
from numba.core import event

from robsim.kernels.machine.cache import KernelCache
from robsim.kernels.machine.compile_notice import NOTICE
from robsim.kernels.machine.deferred_interrupt import DeferredInterrupt


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


for _listener in (NOTICE, CollectorPause()):
    event.register("numba:compile", _listener)
event.register("numba:compiler_lock", DeferredInterrupt())  # Numba holds this lock for loading, too


def kernel(
    function: Callable[..., Any], inline: str = "never", address: bool = False
) -> Callable[..., Any]:
    """Return a compiled function without GIL, with IEEE division, without fast-math.

    Its machine code is cached on disk. Python and other kernels can call it. With `address` only
    machine code can call it, by the address of a C wrapper.
    """
    options: Any = {"nogil": True, "error_model": "numpy", "inline": inline}
    options |= {"no_cpython_wrapper": address, "no_cfunc_wrapper": not address}
    compiled: Any = numba.njit(**options)(function)
    compiled._cache = KernelCache(function)
    return compiled  # type: ignore[no-any-return]


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel that Numba inlines into its callers and does not compile alone."""
    return kernel(function, inline="always")
