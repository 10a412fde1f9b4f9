"""The parameters to whose arrays a kernel writes, found in its source.

Assignments to items are followed through names, slices, views, tuples, and calls of other kernels.
Order and conditions of statements do not count, and `x += 1` is taken to change a number.
"""

import ast
import builtins
import inspect
import textwrap
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from robsim.kernels.machine.entry import CFunction
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import Kernel

WRITERS = {"put": (0,), "call_stage": (3,), "make_linked_call": (0,), "make_unrolled_kernel": (1,)}
VIEWS = {"carray", "make_address_cast", "point_to_row", "point_to_numbers", "cast_to_unsigned"}
READERS = {
    *("get", "get_lane", "replace_lane", "fill_lanes", "sqrt", "absolute", "floor", "where"),
    *("copy_sign", "any_lane", "least_lane", "align_stack", "load_word"),
}
NEW = {np.empty, np.empty_like, np.zeros, np.hypot, np.rint, np.sqrt}
NEW |= {np.uint8, np.int32, np.uint32, np.int64, np.uint64, np.float32}
LONGEST = 8  # path, so that a loop `x = x[1:]` ends
VIEW_METHODS = {"reshape", "ravel", "view", "transpose"}
COPY_METHODS = {"copy", "astype", "sum", "min", "max", "mean", "any", "all", "item"}


@dataclass
class Value:
    """The paths of parameters that a value may be, and its items if it is a tuple.

    A path is the name of a parameter and steps: indices, names of fields, or None.
    """

    paths: set = field(default_factory=set)
    items: list | None = None
    fields: tuple = ()

    def all_paths(self):
        return self.paths.union(*(each.all_paths() for each in self.items or ()))

    def step(self, key):
        """Return the value of an item or an attribute."""
        if self.items is not None:
            index = self.fields.index(key) if key in self.fields else key
            if isinstance(index, int) and index < len(self.items):
                return self.items[index]
            return Value(self.all_paths())
        return Value({(*path, key)[:LONGEST] for path in self.paths})

    def join(self, other):
        items, fields = self.items or other.items, self.fields or other.fields
        if self.items and other.items:
            if len(self.items) != len(other.items):
                return Value(self.all_paths() | other.all_paths())
            items = [a.join(b) for a, b in zip(self.items, other.items, strict=True)]
        return Value(self.paths | other.paths, items, fields)

    def follow(self, steps):
        value = self
        for each in steps:
            value = value.step(each)
        return value


class Analysis(ast.NodeVisitor):
    """Names and writes of a function."""

    def __init__(self, function):
        self.function = function
        source = textwrap.dedent(inspect.getsource(function))
        (self.tree,) = ast.parse(source).body
        self.parameters = list(inspect.signature(function).parameters)
        self.names = {each: Value({(each,)}) for each in self.parameters}
        self.functions = {}  # local names of functions
        self.written, self.returned = set(), Value()
        before = None
        while before != (self.names, self.written):
            before = dict(self.names), set(self.written)
            for each in self.tree.body:
                self.visit(each)

    def visit_Assign(self, node):
        function, value = self.find(node.value), self.visit(node.value)
        for target in node.targets:
            if function is not None and isinstance(target, ast.Name):
                self.functions[target.id] = function
            else:
                self.assign(target, value)

    def visit_AugAssign(self, node):
        self.visit(node.value)
        if not isinstance(node.target, ast.Name):
            self.assign(node.target, Value())

    def visit_For(self, node):
        self.assign(node.target, self.value_of_item(node.iter))
        for each in [*node.body, *node.orelse]:
            self.visit(each)

    def visit_Return(self, node):
        if node.value:
            self.returned = self.returned.join(self.visit(node.value))

    def assign(self, target, value):
        if isinstance(target, ast.Name):
            self.names[target.id] = self.names.get(target.id, Value()).join(value)
        elif isinstance(target, ast.Tuple):
            for i, each in enumerate(target.elts):
                self.assign(each, value.step(i))
        elif isinstance(target, ast.Subscript):
            self.visit(target.slice)
            self.written |= self.visit(target.value).all_paths()
        else:
            raise AssertionError(ast.dump(target))

    def value_of_item(self, node):
        """Return the value of the items over which a loop goes."""
        called = self.find(node.func) if isinstance(node, ast.Call) else None
        if called not in (zip, enumerate):
            return self.visit(node).step(None)
        items = [self.value_of_item(each) for each in node.args]
        return Value(items=[Value(), *items] if called is enumerate else items)

    def visit_Name(self, node):
        return self.names.get(node.id, Value())

    def visit_Tuple(self, node):
        return Value(items=[self.visit(each) for each in node.elts])

    def visit_Attribute(self, node):
        return self.visit(node.value).step(node.attr)

    def visit_Subscript(self, node):
        self.visit(node.slice)
        is_constant = isinstance(node.slice, ast.Constant)
        return self.visit(node.value).step(node.slice.value if is_constant else None)

    def visit_IfExp(self, node):
        self.visit(node.test)
        return self.visit(node.body).join(self.visit(node.orelse))

    def generic_visit(self, node):
        """Visit a statement, or an operator, whose result is a new value."""
        super().generic_visit(node)
        return Value()

    def visit_Call(self, node):
        if isinstance(node.func, ast.Attribute) and self.find(node.func) is None:
            own, name = self.visit(node.func.value), node.func.attr
            assert name in VIEW_METHODS | COPY_METHODS, ast.unparse(node)
            return own if name in VIEW_METHODS else Value()
        arguments = self.arguments(node)
        called = self.find(node.func)
        assert called is not None, f"{self.function}: {ast.unparse(node)}"
        if isinstance(called, type) and hasattr(called, "_fields"):
            return Value(items=arguments, fields=called._fields)
        if isinstance(called, Intrinsic) and called.name != "make_routine":
            assert called.name in {*WRITERS, *VIEWS, *READERS}, called
            for i in WRITERS.get(called.name, ()):
                self.written |= arguments[i].all_paths()
            paths = set().union(*(each.all_paths() for each in arguments))
            return Value(paths) if called.name in VIEWS else Value()
        function = find_function(called)
        if function is None:
            known = called in NEW or called.__module__ in ("builtins", "math")
            assert known, f"not known whether {called} returns a view"
            return Value()
        assert not node.keywords, ast.unparse(node)
        return self.call_kernel(analyse(function), arguments)

    def arguments(self, node):
        """Return the values of the arguments of a call."""
        found = []
        for each in node.args:
            if isinstance(each, ast.Starred):
                items = self.visit(each.value).items
                assert items is not None, ast.unparse(node)
                found += items
            else:
                found.append(self.visit(each))
        return found

    def call_kernel(self, inner, arguments):
        given = dict(zip(inner.parameters, arguments, strict=False))
        for name, *steps in inner.written:
            if name in given:
                self.written |= given[name].follow(steps).all_paths()
        return substitute(inner.returned, given)

    def find(self, node):
        """Return the object outside of the function that a name or an attribute is."""
        if isinstance(node, ast.Name):
            if node.id in self.names:
                return None
            if node.id in self.functions:
                return self.functions[node.id]
            function = self.function
            cells = dict(
                zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
            )
            if node.id in cells:
                return cells[node.id].cell_contents
            return function.__globals__.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute):
            return getattr(self.find(node.value), node.attr, None)
        return None


def substitute(value, given):
    """Return a value of a callee in terms of its caller."""
    found = Value(items=value.items and [substitute(each, given) for each in value.items])
    found.fields = value.fields
    for name, *steps in value.paths:
        if name in given:
            found = found.join(given[name].follow(steps))
    return found


def find_function(called):
    """Return the Python function of a kernel or a routine, or None."""
    if isinstance(called, Kernel):
        return called.py_func
    return called.arguments[0] if isinstance(called, Intrinsic) else None


@cache
def analyse(function):
    return Analysis(function)


def find_outputs(variant: CFunction):
    """Return the paths of the arrays, as in `CFunction.outputs`, to which a kernel writes."""
    declared = ast.parse(f"({variant.types.declaration.replace('out ', '~')},)", mode="eval").body
    kinds = dict(zip(variant.types.names, declared.elts, strict=True))
    found = set()
    for name, *steps in analyse(variant.function).written:
        found |= resolve(kinds[name], name, steps, variant.function.__globals__)
    return found


def resolve(kind, path, steps, namespace):
    """Return the paths of the arrays of a declared type that steps reach."""
    if isinstance(kind, ast.UnaryOp):
        return resolve(kind.operand, path, steps, namespace)
    if isinstance(kind, ast.Subscript):
        return {path}
    if not isinstance(kind, ast.Tuple | ast.Call):
        return set()  # None, or a number: the memory at an address
    parts = kind.elts if isinstance(kind, ast.Tuple) else kind.args
    first, *rest = steps or [None]
    if isinstance(first, str):
        first = namespace[kind.func.id]._fields.index(first)
    chosen = range(len(parts)) if first is None else [first]
    return set().union(*(resolve(parts[i], f"{path}[{i}]", rest, namespace) for i in chosen))
