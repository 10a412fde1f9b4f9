"""The decorator that compiles kernels."""

from collections.abc import Callable
from typing import Any

import numba
from numba.core import event

from robsim.kernels.machine.cache import KernelCache
from robsim.kernels.machine.compile_notice import NOTICE
from robsim.kernels.machine.deferred_interrupt import DeferredInterrupt
from robsim.kernels.machine.uncollected import CollectorPause

for _listener in (NOTICE, CollectorPause()):
    event.register("numba:compile", _listener)
event.register("numba:compiler_lock", DeferredInterrupt())  # which is held for loading, too


def kernel(
    function: Callable[..., Any], inline: str = "never", address: bool = False
) -> Callable[..., Any]:
    """Compile for run-last float64 arrays: no GIL, IEEE division, no fast-math, cached on disk.

    It is called by Python and by kernels, or else by its `address`.
    """
    options: Any = {"nogil": True, "error_model": "numpy", "inline": inline}
    options |= {"no_cpython_wrapper": address, "no_cfunc_wrapper": not address}
    compiled: Any = numba.njit(**options)(function)
    if compiled is not function:  # as it is where Numba is told not to compile
        compiled._cache = KernelCache(function)
    return compiled  # type: ignore[no-any-return]


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that is inlined into its callers, so that it is not compiled alone."""
    return kernel(function, inline="always")
