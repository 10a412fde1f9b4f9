"""The LLVM code that Numba generates for stages and entries, as texts, before any pass.

Numba compiles each function into libraries of modules. The texts of the modules are recorded on
their way to LLVM, and LLVM's passes and machine code are left out, as nothing here runs.
"""

import gc
import importlib
import pkgutil
from dataclasses import dataclass, field

from numba.core import cgutils, codegen
from numba.core.registry import cpu_target

import robsim.kernels
from robsim.kernels.machine import python_functions
from robsim.kernels.machine.compiler import dispatchers, linked_calls
from robsim.kernels.machine.compiler.cache import KernelCache
from robsim.kernels.machine.entry import Entry
from robsim.kernels.machine.stages import KINDS, CompiledStage


@dataclass
class CFunctionCode:
    """The code of a C function: its types, its library, and its name in the library."""

    kinds: tuple[str, ...]
    returns_status: bool
    library: str
    name: str


@dataclass
class NumbaTexts:
    """The texts of all functions.

    Attributes
    ----------
    functions : dict
        Symbol: `CFunctionCode`.
    modules, links : dict
        Name of a library: texts of its modules, and names of the libraries that it calls.
    """

    functions: dict = field(default_factory=dict)
    modules: dict = field(default_factory=dict)
    links: dict = field(default_factory=dict)


def record_numba_texts():
    """Return the texts of all stages and entries of the package."""
    texts = NumbaTexts()
    _record_modules(texts)
    for symbol, make, kinds, returns_status in list_c_functions():
        overload = dispatchers.compile_overload(make(), kinds)
        library, name = overload.library.name, overload.fndesc.mangled_name
        texts.functions[symbol] = CFunctionCode(kinds, returns_status, library, name)
    return texts


def list_c_functions():
    """Return (symbol, function that returns the code, argument types, has a status), sorted."""
    for module in pkgutil.walk_packages(robsim.kernels.__path__, "robsim.kernels."):
        importlib.import_module(module.name)
    call_entry = python_functions.SYMBOL, python_functions.make_call_entry
    found = [(*call_entry, ("int64",) * 3, True)]
    for each in gc.get_objects():
        if isinstance(each, CompiledStage):
            found.append((each.symbol, each.make_wrapper, KINDS, False))
        elif isinstance(each, Entry):
            found += [(v.symbol, v.make_wrapper, v.kinds, True) for v in each.variants]
    symbols = [symbol for symbol, *_ in found]
    assert len(set(symbols)) == len(symbols), "two functions have the same symbol"
    return sorted(found, key=lambda each: each[0])


def _record_modules(texts):
    """Let Numba's libraries record their modules instead of passing them to LLVM's passes."""
    library = codegen.JITCodeLibrary
    link = library.add_linking_library

    def add_module(self, module):
        text = cgutils.normalize_ir_text(str(module))
        texts.modules.setdefault(self.name, []).append(text)
        add(self, module)

    def add_library(self, other):
        linked = texts.links.setdefault(self.name, [])
        if other.name not in linked:
            linked.append(other.name)
        link(self, other)

    add = library.add_ir_module
    library.add_ir_module, library.add_linking_library = add_module, add_library
    library._optimize_functions = library._optimize_final_module = lambda self, *_: None
    library._finalize_specific = lambda self: None
    cpu_target.target_context.get_executable = lambda *_: [].append  # a key, not called
    linked_calls.link_symbol = lambda symbol: None
    KernelCache.load_overload = KernelCache.save_overload = lambda *_: None
