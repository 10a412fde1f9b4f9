"""Entries declare the arrays to which they write, and no others."""

import importlib
import pkgutil
from typing import Any, NamedTuple

import pytest
from written_parameters import find_outputs

import robsim.kernels
from robsim.kernels.machine.array_views import as_matrix
from robsim.kernels.machine.entry import Entry, entry
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import perform_on_block


def list_variants():
    found = pkgutil.walk_packages(robsim.kernels.__path__, "robsim.kernels.")
    modules = [importlib.import_module(each.name) for each in found if ".compiler" not in each.name]
    values = [each for module in modules for each in vars(module).values()]
    entries = {each for each in values if isinstance(each, Entry)}
    return [variant for each in entries for variant in each.variants]


def test_each_entry_declares_the_arrays_to_which_it_writes():
    variants = list_variants()
    assert len(variants) >= 75
    wrong = {each.symbol: find_outputs(each) ^ each.outputs for each in variants}
    assert {symbol: paths for symbol, paths in wrong.items() if paths} == {}


class Pair(NamedTuple):
    """Two arrays."""

    x: Any
    y: Any


@kernel
def fill_pair(pair, value):
    pair.y[0] = value


@routine
def copy_row(source, target):
    for i in range(source.size):
        target[i] = source[i]


@routine
def choose(a, b, first):
    return a if first else b


A, M = "float64[::1]", "float64[:, ::1]"
SAMPLES = {
    "an item": (f"{A}, out {A}", "y[0] = x[0]"),
    "an item of a row": (f"{M}, out {M}", "y[0][0] = x[0, 0]"),
    "a sum": (f"{A}, out {A}", "y[0] += x[0]"),
    "two items": (f"out {A}, out {A}", "x[0], y[0] = 1.0, 2.0"),
    "a chain": (f"out {A}, out {A}", "x[0] = y[0] = 2.0"),
    "another name": (f"{A}, out {A}", "z = y\n    z[0] = x[0]"),
    "a slice": (f"{A}, out {A}", "z = y[1:]\n    z[0] = x[0]"),
    "a loop": (f"{A}, out {M}", "for row in y:\n        row[0] = x[0]"),
    "pairs": (f"{M}, out {M}", "for a, b in zip(x, y):\n        b[0] = a[0]"),
    "counted": (f"{A}, out {M}", "for i, b in enumerate(y):\n        b[0] = i"),
    "a condition": (f"out {A}, out {A}", "z = x if x[0] > 0.0 else y\n    z[0] = 1.0"),
    "a returned argument": (f"out {A}, out {A}", "choose(x, y, True)[0] = 1.0"),
    "a view": (f"{A}, out {A}", "as_matrix(y, 2, 2)[0, 0] = x[0]"),
    "a call": (f"{M}, out {M}", "copy_row(x[0], y[1])"),
    "a call with a list": (f"{A}, out {A}", "copy_row(*(x, y))"),
    "a named tuple": (f"{A}, out {A}", "fill_pair(Pair(x, y), 1.0)"),
    "a field": (f"{A}, Pair({A}, out {A})", "fill_pair(y, x[0])"),
    "a field by its index": (f"{A}, Pair(out {A}, {A})", "y[0][1] = x[0]"),
    "unpacked fields": (f"{A}, ({A}, out {A})", "a, b = y\n    b[0] = x[0] + a[0]"),
    "a tuple": (f"{A}, out ({A}, {A})", "a, b = y\n    a[0] = b[0] = x[0]"),
    "lanes": (f"{A}, out {A}", "put(y, 0, get(x, 0))"),
    "stages": (f"int64[::1], out {A}", "perform_on_block(x, x, x, y, 0)"),
    "a copy": (f"{A}, {A}", "z = y.copy()\n    z[0] = x[0]"),
    "nothing": (f"{A}, {A} -> float64", "return x[0] + y[0]"),
}
NAMES = (as_matrix, choose, copy_row, fill_pair, get, put, perform_on_block, Pair)


@pytest.mark.parametrize("case", SAMPLES)
def test_a_write_is_found(case, tmp_path, monkeypatch):
    declaration, body = SAMPLES[case]
    (tmp_path / "sample_kernel.py").write_text(f"def sample(x, y):\n    {body}\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(importlib.sys.modules, "sample_kernel", raising=False)
    module = importlib.import_module("sample_kernel")
    names = {name: each for name, each in globals().items() if each in NAMES}
    vars(module).update(names)
    (variant,) = entry(declaration)(module.sample).variants
    assert find_outputs(variant) == variant.outputs
