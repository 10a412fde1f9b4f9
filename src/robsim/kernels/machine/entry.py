"""Entries: kernels that Python calls, with declared argument types.

The machine code of an entry is a C function, as that of a stage. It is found in the package or made
once, for the declared types, and called through `ctypes`.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robsim.kernels.machine.argument_types import DTYPES, ArgumentTypes
from robsim.kernels.machine.array_objects import (
    axis_size,
    data_address,
    describe_array_types,
    is_array,
)
from robsim.kernels.machine.array_views import carray, cast_address_to
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import Kernel, name_like, part
from robsim.kernels.machine.machine_code import PACKAGE_CODE, find_address

_TYPES = describe_array_types()
_ADDRESS = int(_TYPES.ctypes.data)
_C_TYPES = {"int64": ctypes.c_int64, "uint64": ctypes.c_uint64, "float64": ctypes.c_double}
_NAMES = {
    **{"fits": is_array, "size": axis_size, "data": data_address, "carray": carray},
    **{f"to_{each}": cast_address_to(each) for each in DTYPES},
    "put_result": Intrinsic("array_pointers", "store_number"),
}


_RESULTS = {"float64": "out_[{}]", "int64": "int(out_[{}])", "bool": "out_[{}] != 0.0"}
_PLAIN = {np.dtype(each): np.dtype(each) for each in DTYPES}  # the objects that machine code knows


class CFunction:
    """The C function of an entry for one list of argument types."""

    def __init__(self, function: Callable[..., Any], declaration: str, number: int) -> None:
        self.function = function
        declaration, _, results = map(str.strip, declaration.partition("->"))
        self.types = ArgumentTypes(list(inspect.signature(function).parameters), declaration)
        self.results = [each.strip() for each in results.split(",") if results]
        self.performs_stages = "addresses" in self.types.names or "code" in self.types.names
        self.writes_results = self.results not in ([], ["bool"])
        mark = self.mark = f".{number}" if number else ""
        self.symbol = f"robsim.{function.__module__}.{function.__qualname__}{mark}"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The types of the C arguments."""
        leaves = [each.kind for each in self.types.leaves]
        return ("int64", *leaves, *(["int64"] if self.writes_results else []))

    def make_wrapper(self) -> Callable[..., Any]:
        """Return the function that Numba compiles."""
        function = self.function
        namespace = {**function.__globals__, **_NAMES, "body": part(function)}
        exec(self.types.wrapper(self.results), namespace)
        wrapper = name_like(function, namespace["wrapper"])
        wrapper.__qualname__ += self.mark  # the name in the cache: variants may have the same kinds
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
        address = find_address(self.symbol, self.make_wrapper, self.kinds)
        leaves: list[Any] = [
            ctypes.py_object if each.axes else _C_TYPES[each.kind] for each in self.types.leaves
        ]
        extra = [ctypes.c_int64] if self.writes_results else []
        code = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, *leaves, *extra)(address)
        numbers = ctypes.c_double * len(self.results)
        namespace: dict[str, Any] = {"code_": code, "numbers_": numbers}
        namespace |= {"address_of_": ctypes.addressof, "Misfit_": ctypes.ArgumentError}
        namespace |= {"refuse_": self._refuse, "package_": PACKAGE_CODE}
        exec(self._caller(), namespace)
        return namespace[self.function.__name__]  # type: ignore[no-any-return]

    def _refuse(self, status: int) -> Any:
        """Return NotImplemented for arguments that do not fit; raise MemoryError for a failure."""
        if status:
            return NotImplemented
        raise MemoryError(
            f"kernel '{self.function.__name__}' failed: too little memory for its arrays"
        )

    def _caller(self) -> str:
        """Return the code of the Python function; its own names end with an underscore."""
        passed = [str(_ADDRESS), *(each.path for each in self.types.leaves)]
        lines = [f"def {self.function.__name__}({', '.join(self.types.names)}):"]
        lines += [f" if {path} is not None: return NotImplemented" for path in self.types.absent]
        if self.performs_stages:
            lines += [" failures_ = package_.failures", " before_ = failures_.value"]
        if self.writes_results:
            lines += [" out_ = numbers_()"]
            passed += ["address_of_(out_)"]
        lines += [" try:", f"  status_ = code_({', '.join(passed)})"]
        lines += [" except Misfit_: return NotImplemented"]
        lines += [" if status_ < 2: return refuse_(status_)"]
        if self.performs_stages:
            lines += [" if failures_.value != before_: return refuse_(0)"]
        if self.results == ["bool"]:
            lines += [" return status_ == 2"]
        elif self.results:
            found = [_RESULTS[each].format(i) for i, each in enumerate(self.results)]
            lines += [f" return {', '.join(found)}"]
        return "\n".join(lines)


class Entry(Kernel):
    """A kernel that Python calls with arguments of declared types.

    Attributes
    ----------
    variants : list of CFunction
        One C function for each declared list of types.
    """

    def __init__(
        self, function: Callable[..., Any], declarations: Sequence[str], inline: str
    ) -> None:
        super().__init__(function, inline)
        self.variants = [CFunction(function, each, i) for i, each in enumerate(declarations)]
        self._call: Callable[..., Any] = self._load_first

    def __call__(self, *arguments: Any) -> Any:
        """Perform the kernel."""
        found = self._call(*arguments)
        return self._try_variants(arguments) if found is NotImplemented else found

    def _load_first(self, *arguments: Any) -> Any:
        """Load the first variant that may fit, and call it."""
        fitting = (each for each in self.variants if each.may_take(arguments))
        self._call = next(fitting, self.variants[0]).call
        return self._call(*arguments)

    def _try_variants(self, arguments: tuple[Any, ...]) -> Any:
        """Perform the kernel for arguments that do not fit as they are.

        Arrays in another order are copied, and afterwards the changed copies are written back.
        """
        copies: list[tuple[Any, Any, bytes]] = []
        plain = tuple(_convert(each, copies) for each in arguments)
        for each in self.variants:
            found = each.call(*plain) if each.may_take(plain) else NotImplemented
            if found is not NotImplemented:
                for original, copy, before in copies:
                    if copy.tobytes() != before:
                        original[...] = copy
                return found
        expected = " or ".join(each.types.declaration for each in self.variants)
        got = ", ".join(map(_describe_argument, arguments))
        raise TypeError(f"kernel '{self.py_func.__name__}' takes {expected}; got {got}")


def entry(*declarations: str, inline: str = "never") -> Callable[[Callable[..., Any]], Entry]:
    """Return the decorator of a kernel that Python calls.

    Each declaration is a list of argument types, see `argument_types`, and after `->` the types of
    the results, if there are any. With `inline="always"` Numba inlines the kernel into kernels.
    """
    return lambda function: Entry(function, declarations, inline)


def _convert(value: Any, copies: list[tuple[Any, Any, bytes]]) -> Any:
    """Return an argument as C takes it, and add the arrays that were copied to `copies`."""
    if isinstance(value, tuple):
        parts = [_convert(each, copies) for each in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, np.ndarray) and value.ndim:
        plain = np.require(value, requirements=["C", "A"]).view(np.ndarray)
        copies += [] if np.may_share_memory(plain, value) else [(value, plain, plain.tobytes())]
        return plain.view(_PLAIN.get(plain.dtype, plain.dtype))  # an unpickled one has its own
    return value.item() if isinstance(value, np.ndarray | np.generic) else value


def _describe_argument(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_describe_argument, value))})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype}[{', '.join(':' * value.ndim)}]"
    return type(value).__name__
