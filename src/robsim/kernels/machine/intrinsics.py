"""Functions that generate machine code. Only kernels can call them.

Their definitions belong to Numba's side of the machine layer. They are imported when Numba compiles
the first kernel that calls them, so the import of a kernel's module does not import Numba.
"""

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any

from robsim.kernels.machine.sources import COMPILER


def import_compiler(module: str) -> Any:
    """Return a module of Numba's side, imported late; `sources` counts them for every kernel."""
    return import_module(f"{COMPILER}.{module}")


class Intrinsic:
    """A function of Numba's side: `name` of a module, or the result of `name(*arguments)`."""

    def __init__(self, module: str, name: str, *arguments: Any) -> None:
        self.module, self.name, self.arguments = module, name, arguments

    @cached_property
    def function(self) -> Any:
        """The function that Numba knows."""
        found = getattr(import_compiler(self.module), self.name)
        return found(*self.arguments) if self.arguments else found

    def __repr__(self) -> str:
        return f"Intrinsic({self.module}.{self.name})"

    def __call__(self, *arguments: Any) -> Any:
        """Raise TypeError: Python cannot perform machine instructions."""
        raise TypeError(f"only kernels can call {self!r}")


def routine(function: Callable[..., Any]) -> Any:
    """Return a function that kernels can call, without machine code of its own.

    Its code is optimised once, in its caller. It cannot allocate arrays.
    """
    return Intrinsic("routines", "make_routine", function, False)


def fragment(function: Callable[..., Any]) -> Any:
    """Return a routine that LLVM inlines into each caller.

    It is for code with many arguments that is called for each pixel. Named tuples that it takes are
    written to memory, so it takes only the arrays that it needs where time counts.
    """
    return Intrinsic("routines", "make_routine", function, True)


def unroll_kernel(kernel: Any, places: tuple[int, ...], sizes: dict[int, int]) -> Any:
    """Return a function (p, w) that performs kernel(p, w) for fixed entries of p.

    `sizes` maps indices of p to the fixed entries. `places` are the indices of p that hold rows in
    memory. All other rows of the kernel are temporary and must have fixed indices.
    """
    return Intrinsic("fixed_size", "make_unrolled_kernel", kernel, places, sizes)
