"""Declared argument types of kernels that Python calls, such as "float64[:, ::1], int64".

A type is one of

    int64, uint64, float64, bool    a number
    float64[:, ::1]                 an array in C order, here with two axes, of one of `DTYPES`
    (int64, float64[::1])           a tuple
    Faces(float64[:, ::1], None)    a named tuple, of a class that the kernel's module knows

and `out` before the type of an array, or of a tuple, declares that the kernel writes to the array,
or to all arrays of the tuple:

    float64[::1], out float64[:, ::1]

C passes numbers and arrays as words of 64 bits. The word of an array is the address of the Python
object. Machine code reads the fields of this object, which NumPy's C interface fixes, so a call
does not convert anything.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

DTYPES = (*("bool", "uint8", "uint16", "uint32", "uint64", "int32", "int64"), "float32", "float64")
NUMBERS = ("int64", "uint64", "float64", "bool")
_OUT = re.compile(r"\bout\s+")  # read as the operator ~, which Python's grammar has
_VALUES = {"int64": "{}", "uint64": "unsigned({})", "float64": "{}", "bool": "{} != 0"}
RESULTS = {"int64": "words[{}] = {}", "float64": "numbers[{}] = {}"}
RESULTS["bool"] = "words[{}] = 1 if {} else 0"


@dataclass
class Leaf:
    """A number or an array among the arguments, perhaps inside of tuples.

    Attributes
    ----------
    name : str
        Name of the argument of the C function.
    path : str
        Python expression of its value, such as "faces[2]".
    dtype : str
        Type of the number, or of the elements of the array.
    axes : int
        Number of axes of the array; 0 for a number.
    is_output : bool
        Whether the kernel writes to the array.
    """

    name: str
    path: str
    dtype: str
    axes: int
    is_output: bool = False

    @property
    def kind(self) -> str:
        """The type of the number, or "array"."""
        return "array" if self.axes else self.dtype

    @property
    def test(self) -> str:
        """The condition under which an object is such an array, in the code of a wrapper."""
        test = "is_writable" if self.is_output else "is_array"
        return f"{test}(types, {self.name}, {2 + DTYPES.index(self.dtype)}, {self.axes})"

    @property
    def value(self) -> str:
        """The value in the code of a wrapper."""
        if not self.axes:
            return _VALUES[self.dtype].format(self.name)
        sizes = "".join(f"size(types, {self.name}, {i}), " for i in range(self.axes))
        return f"carray(to_{self.dtype}(data(types, {self.name})), ({sizes}))"


@dataclass
class ArgumentTypes:
    """The argument types of a kernel, read from their declaration.

    Attributes
    ----------
    leaves : list of Leaf
        The arguments of the C function.
    values : list of str
        The arguments of the kernel, in the code of a wrapper.
    absent : list of str
        Python expressions of the values that must be None.
    """

    names: list[str]
    declaration: str
    leaves: list[Leaf] = field(default_factory=list)
    values: list[str] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        declared = ast.parse(f"({_OUT.sub('~', self.declaration)},)", mode="eval").body
        assert isinstance(declared, ast.Tuple)
        if len(declared.elts) != len(self.names):
            raise TypeError(f"{len(self.names)} arguments, but types {self.declaration}")
        self.values = [
            self._read(node, name) for node, name in zip(declared.elts, self.names, strict=True)
        ]

    def _read(self, node: ast.expr, path: str, is_output: bool = False) -> str:
        """Add the leaves of a type; return the value of the argument in the code of a wrapper."""
        if isinstance(node, ast.UnaryOp):
            node, is_output = node.operand, True
        if isinstance(node, ast.Constant) and node.value is None:
            self.absent.append(path)
            return "None"
        if isinstance(node, ast.Tuple | ast.Call):
            parts = node.elts if isinstance(node, ast.Tuple) else node.args
            values = "".join(
                f"{self._read(part, f'{path}[{i}]', is_output)}, " for i, part in enumerate(parts)
            )
            return f"{ast.unparse(node.func) if isinstance(node, ast.Call) else ''}({values})"
        axes, named = 0, node
        if isinstance(node, ast.Subscript):
            axes = len(node.slice.elts) if isinstance(node.slice, ast.Tuple) else 1
            named = node.value
        dtype = ast.unparse(named)
        if dtype not in (DTYPES if axes else NUMBERS):
            raise TypeError(f"unknown argument type {ast.unparse(node)}")
        if is_output and not axes:
            raise TypeError(f"a kernel cannot write to a number, out {dtype}")
        self.leaves.append(Leaf(f"a{len(self.leaves)}", path, dtype, axes, is_output))
        return self.leaves[-1].value

    def wrapper(self, results: Sequence[str]) -> str:
        """Return the code of a function that calls the kernel `body`.

        The pointers `words` and `numbers` have the same address. The function reads the values of
        the leaves there and writes the results. It returns a status: 1 without a call if an
        argument does not fit, and 2 otherwise. The status is 0 after a failure.
        """
        lines = ["def wrapper(types, words, numbers):"]
        for i, each in enumerate(self.leaves):
            lines.append(
                f"    {each.name} = {'numbers' if each.kind == 'float64' else 'words'}[{i}]"
            )
        lines += [f"    if not {each.test}:\n        return 1" for each in self.leaves if each.axes]
        call = f"body({', '.join(self.values)})"
        lines += [f"    found = {call}" if results else f"    {call}"]
        for i, kind in enumerate(results):
            found = "found" if len(results) == 1 else f"found[{i}]"
            lines.append("    " + RESULTS[kind].format(i, found))
        return "\n".join([*lines, "    return 2"])
