"""The decorators of kernels, which Numba compiles when machine code is first needed."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any

from robsim.kernels.machine.intrinsics import import_compiler


class Kernel:
    """A function of numbers and arrays that other kernels call.

    It runs without the GIL, divides as IEEE 754 says, and uses no fast-math. A call from Python
    compiles it for the types of the arguments.

    Attributes
    ----------
    py_func : callable
        The Python function.
    targetoptions : dict
        The option by which Numba inlines the kernel into its callers, which reads both attributes.
    """

    def __init__(self, function: Callable[..., Any], inline: str = "never") -> None:
        self.py_func, self.targetoptions = function, {"inline": inline}
        update_wrapper(self, function)

    @cached_property
    def dispatcher(self) -> Any:
        """Numba's dispatcher, which holds the machine code for each list of argument types."""
        make = import_compiler("dispatchers").make_dispatcher
        return make(self.py_func, self.targetoptions["inline"])

    def __call__(self, *arguments: Any) -> Any:
        """Perform the kernel."""
        return self.dispatcher(*arguments)


def kernel(function: Callable[..., Any]) -> Kernel:
    """Return a function as a kernel, which has machine code of its own."""
    return Kernel(function)


def part(function: Callable[..., Any]) -> Kernel:
    """Return a function as a kernel that Numba inlines into its callers."""
    return Kernel(function, inline="always")


def name_like(function: Callable[..., Any], wrapper: Any) -> Any:
    """Return a generated function with the name, the file and the line of another function."""
    own = function.__code__
    wrapper.__code__ = wrapper.__code__.replace(
        co_filename=own.co_filename, co_firstlineno=own.co_firstlineno, co_name=own.co_name
    )
    wrapper.__module__, wrapper.__qualname__ = function.__module__, function.__qualname__
    return wrapper
