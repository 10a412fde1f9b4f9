"""Entries: kernels that Python calls, with declared argument types.

The machine code of an entry is a C function, as that of a stage. It is found in the package or made
once, for the declared types, and called as a function of Python that machine code performs.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np

from robsim.kernels.machine import array_objects, python_functions
from robsim.kernels.machine.argument_types import DTYPES, RESULTS, ArgumentTypes
from robsim.kernels.machine.array_views import carray, cast_address_to
from robsim.kernels.machine.kernel import Kernel, name_like, part
from robsim.kernels.machine.machine_code import find_address

_NAMES = {
    **{"is_array": array_objects.is_array, "is_writable": array_objects.is_writable_array},
    **{"size": array_objects.axis_size, "data": array_objects.data_address, "carray": carray},
    **{f"to_{each}": cast_address_to(each) for each in DTYPES},
    "unsigned": np.uint64,
}
_PLAIN = {np.dtype(each): np.dtype(each) for each in DTYPES}  # the objects that machine code knows


class CFunction:
    """The C function of an entry for one list of argument types."""

    kinds = "int64", "int64*", "float64*"  # of the C arguments: the last two are the same address

    def __init__(self, function: Callable[..., Any], declaration: str, number: int) -> None:
        self.function = function
        declaration, _, results = map(str.strip, declaration.partition("->"))
        self.types = ArgumentTypes(list(inspect.signature(function).parameters), declaration)
        self.results = [each.strip() for each in results.split(",") if results]
        if wrong := [each for each in self.results if each not in RESULTS]:
            raise TypeError(f"unknown result type {wrong[0]}")
        if len(self.types.leaves) > python_functions.MOST:
            raise TypeError(f"{len(self.types.leaves)} arguments, but only {python_functions.MOST}")
        self.outputs = {each.path for each in self.types.leaves if each.is_output}
        mark = self.mark = f".{number}" if number else ""
        self.symbol = f"robsim.{function.__module__}.{function.__qualname__}{mark}"

    def make_wrapper(self) -> Callable[..., Any]:
        """Return the function that Numba compiles."""
        function = self.function
        namespace = {**function.__globals__, **_NAMES, "body": part(function)}
        exec(self.types.wrapper(self.results), namespace)
        wrapper = name_like(function, namespace["wrapper"])
        wrapper.__qualname__ += self.mark  # the name in the cache: variants have the same kinds
        return wrapper  # type: ignore[no-any-return]

    @cached_property
    def _has_none_in_place(self) -> Callable[..., bool]:
        """The function that returns whether arguments are None where they must be, and only there.

        It needs no machine code.
        """
        tests = [f"{path} is None" for path in self.types.absent]
        tests += [f"{each.path} is not None" for each in self.types.leaves]
        namespace: dict[str, Any] = {}
        exec(f"test = lambda {', '.join(self.types.names)}: {' and '.join(tests)}", namespace)
        return namespace["test"]  # type: ignore[no-any-return]

    @property
    def address(self) -> int:
        """The address of the machine code, which is compiled if there is none."""
        return find_address(self.symbol, self.make_wrapper, self.kinds)

    def may_take(self, arguments: tuple[Any, ...]) -> bool:
        """Return whether machine code for these types may take the arguments."""
        try:
            return self._has_none_in_place(*arguments)
        except (TypeError, LookupError):  # another number of arguments, or no tuple
            return False

    @cached_property
    def call(self) -> Callable[..., Any]:
        """The Python function that calls the machine code.

        It returns NotImplemented if the arguments do not fit.
        """
        return self.build_function(_refuse)

    def build_function(self, otherwise: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that calls the machine code, or `otherwise` for other arguments."""
        names, leaves = self.types.names, self.types.leaves
        has_tuples = [each.path for each in leaves] != names
        code = python_functions.build_function(
            self.function.__name__,
            self.address,
            [each.kind for each in leaves],
            self.results,
            _refuse if has_tuples else otherwise,
            self._fail,
        )
        return self._unpack_tuples(code, otherwise) if has_tuples else code

    def _unpack_tuples(
        self, code: Callable[..., Any], otherwise: Callable[..., Any]
    ) -> Callable[..., Any]:
        """Return a function that passes the items of tuples; its own names end with `_`."""
        name, names = self.function.__name__, ", ".join(self.types.names)
        paths = ", ".join(each.path for each in self.types.leaves)
        other = f"return otherwise_({names})"
        lines = [f"def {name}({names}):"]
        lines += [f" if {path} is not None: {other}" for path in self.types.absent]
        lines += [f" found_ = code_({paths})"]
        lines += [f" if found_ is NotImplemented: {other}", " return found_"]
        namespace: dict[str, Any] = {"code_": code, "otherwise_": otherwise}
        exec("\n".join(lines), namespace)
        return namespace[name]  # type: ignore[no-any-return]

    def _fail(self) -> None:
        """Raise MemoryError: kernels allocate arrays, and nothing else in them can fail."""
        name = self.function.__name__
        raise MemoryError(f"kernel '{name}' failed: too little memory for its arrays")

    def try_arguments(self, arguments: tuple[Any, ...]) -> Any:
        """Perform the kernel for arguments that do not fit as they are.

        Arrays in another order are copied, and the copies that the kernel writes are copied back.
        Return NotImplemented if the arguments have other types.
        """
        copies: list[tuple[Any, Any]] = []
        named = zip(self.types.names, arguments, strict=True)
        found = self.call(*[self._convert(path, value, copies) for path, value in named])
        if found is not NotImplemented:
            for original, copy in copies:
                original[...] = copy
        return found

    def _convert(self, path: str, value: Any, copies: list[tuple[Any, Any]]) -> Any:
        """Return an argument as C takes it, and add the copied outputs to `copies`."""
        if isinstance(value, tuple):
            parts = [self._convert(f"{path}[{i}]", each, copies) for i, each in enumerate(value)]
            return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
        if isinstance(value, np.ndarray) and value.ndim:
            plain = np.require(value, requirements=["C", "A"]).view(np.ndarray)
            if path in self.outputs:
                if not value.flags.writeable:
                    name = self.function.__name__
                    raise ValueError(f"kernel '{name}' writes to {path}, but it is read-only")
                copies += [] if np.may_share_memory(plain, value) else [(value, plain)]
            return plain.view(_PLAIN.get(plain.dtype, plain.dtype))  # an unpickled one has its own
        return value.item() if isinstance(value, np.ndarray | np.generic) else value


class Entry(Kernel):
    """A kernel that Python calls with arguments of declared types.

    Attributes
    ----------
    variants : list of CFunction
        One C function for each declared list of types.
    """

    def __new__(cls, *_: Any) -> Self:
        """Return the only instance of a new class, as Python looks up `__call__` in the class."""
        return super().__new__(type(cls.__name__, (cls,), {}))

    def __init__(
        self, function: Callable[..., Any], declarations: Sequence[str], inline: str
    ) -> None:
        super().__init__(function, inline)
        self.variants = [CFunction(function, each, i) for i, each in enumerate(declarations)]

    def __call__(self, *arguments: Any) -> Any:
        """Perform the kernel.

        The first call replaces this method by the machine code of the first variant that may fit.
        """
        fitting = (each for each in self.variants if each.may_take(arguments))
        call = next(fitting, self.variants[0]).build_function(self._try_variants)
        type(self).__call__ = staticmethod(call)  # type: ignore[method-assign]
        return call(*arguments)

    def _try_variants(self, *arguments: Any) -> Any:
        """Perform the kernel for arguments that do not fit the first code as they are."""
        name, names = self.py_func.__name__, self.variants[0].types.names
        if len(arguments) != len(names):
            raise TypeError(f"{name}({', '.join(names)}) got {len(arguments)} arguments")
        for each in self.variants:
            found = each.try_arguments(arguments) if each.may_take(arguments) else NotImplemented
            if found is not NotImplemented:
                return found
        expected = " or ".join(each.types.declaration for each in self.variants)
        got = ", ".join(map(_describe_argument, arguments))
        raise TypeError(f"kernel '{name}' takes {expected}; got {got}")


def entry(*declarations: str, inline: str = "never") -> Callable[[Callable[..., Any]], Entry]:
    """Return the decorator of a kernel that Python calls.

    Each declaration is a list of argument types, see `argument_types`, and after `->` the types of
    the results, if there are any. With `inline="always"` Numba inlines the kernel into kernels.
    """
    return lambda function: Entry(function, declarations, inline)


def _refuse(*arguments: Any) -> Any:
    return NotImplemented


def _describe_argument(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_describe_argument, value))})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype}[{', '.join(':' * value.ndim)}]"
    return type(value).__name__
