"""The addresses of machine code, found in the package or made once.

The code of a function comes from the first of these places that has it: an archive of the package
for this processor, the user's cache, bitcode of the package, and Numba. Numba is imported in the
last case only.
"""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

from robsim.kernels.machine import cache_files, code_archive, processor_levels
from robsim.kernels.machine.code_archive import CodeArchive
from robsim.kernels.machine.deferred_calls import DeferredCall
from robsim.kernels.machine.deferred_interrupt import DEFERRED_INTERRUPT
from robsim.kernels.machine.intrinsics import import_compiler
from robsim.kernels.machine.sources import digest_of_all

if TYPE_CHECKING:
    from robsim.kernels.machine.code_engine import CodeEngine

LINKED: dict[str, Any] = {}  # symbol: stage that kernels call by this symbol
USES_NUMBA = "ROBSIM_USE_NUMBA"  # environment variable: "1" ignores the code of the package


def find_address(
    symbol: str, make: Callable[[], Callable[..., Any]], kinds: tuple[str, ...]
) -> int:
    """Return the address of the C function with a symbol.

    If the package has no code, Numba compiles `make()` for arguments of some kinds.
    """
    address = PACKAGE_CODE.find(symbol)
    if not address:
        address = import_compiler("dispatchers").compile_c_function(make(), kinds)
    return address


def link_symbol(symbol: str) -> None:
    """Register a call of a linked stage with LLVM."""
    PACKAGE_CODE.link_stage(symbol)


class PackageCode:
    """The code of the package, loaded function by function.

    Attributes
    ----------
    counter : ctypes.c_int64
        Address of the int32 number of stages that have failed.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._addresses: dict[str, int] = {}
        self._calls: dict[str, DeferredCall] = {}
        self._no_failures = ctypes.c_int(0)  # stages count failures only in an engine
        self.counter = ctypes.c_int64(ctypes.addressof(self._no_failures))
        if hasattr(os, "register_at_fork"):  # a child would wait for a lock that nobody releases
            release = self._lock.release
            os.register_at_fork(
                before=self._lock.acquire, after_in_parent=release, after_in_child=release
            )

    @cached_property
    def objects(self) -> CodeArchive | None:
        """The machine code for this processor, if the package has it."""
        found = (self._read(level) for level in processor_levels.find_levels())
        return next((each for each in found if each), None)

    @cached_property
    def bitcode(self) -> CodeArchive | None:
        """The code for other processors."""
        return self._read(code_archive.BITCODE)

    @property
    def is_bitcode_readable(self) -> bool:
        """Whether the package has bitcode of an LLVM that is not later than the one here."""
        return self.bitcode is not None and self.engine.can_read(self.bitcode)

    @cached_property
    def engine(self) -> CodeEngine:
        """The engine that holds the loaded code."""
        from robsim.kernels.machine.code_engine import CodeEngine  # late: llvmlite

        engine = CodeEngine()
        self.counter.value = ctypes.addressof(engine.failures)
        return engine

    def find(self, symbol: str) -> int:
        """Return the address of a function, or 0 if the package has no code that fits."""
        with self._lock, DEFERRED_INTERRUPT:
            if symbol not in self._addresses:
                self._addresses[symbol] = self._load(symbol)
            return self._addresses[symbol]

    def _load(self, symbol: str) -> int:
        for archive in ("objects", "bitcode"):
            found: CodeArchive | None = getattr(self, archive)
            if found and symbol in found.parts and self._links(found.needs[symbol]):
                address = self.engine.load(symbol, found, archive == "bitcode")
                if address:
                    return address
        return 0

    def translate(self, symbols: list[str]) -> None:
        """Translate bitcode for this processor and write it to the user's cache."""
        if self.bitcode:
            for symbol in symbols:
                self.engine.translate(symbol, self.bitcode)

    def _links(self, needs: list[str]) -> bool:
        """Link the stages that a function calls; return whether all its symbols are known."""
        for symbol in LINKED.keys() & needs:
            self.link_stage(symbol)
        return all(symbol in LINKED or self.engine.has_address(symbol) for symbol in needs)

    def link_stage(self, symbol: str) -> None:
        """Register a call with LLVM that finds the code of a linked stage when it is performed."""
        with self._lock, DEFERRED_INTERRUPT:
            if symbol not in self._calls:
                call = DeferredCall(symbol, LINKED[symbol], self.engine.failing_stage)
                self.engine.add_call(symbol, call)
                self._calls[symbol] = call

    @staticmethod
    def _read(name: str) -> CodeArchive | None:
        variables = USES_NUMBA, "NUMBA_BOUNDSCHECK"
        is_numba_asked = any(os.environ.get(each, "0") not in ("", "0") for each in variables)
        return None if is_numba_asked else code_archive.read_archive(name, digest_of_all())


PACKAGE_CODE = PackageCode()


def translate_parts(symbols: list[str]) -> set[str]:
    """Translate bitcode of the package for this processor; return the files of the cache."""
    before = set(cache_files.SAVED)
    PACKAGE_CODE.translate(symbols)
    return cache_files.SAVED - before
