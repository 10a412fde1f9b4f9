"""The engine that holds loaded machine code, and the functions that this code calls."""

from __future__ import annotations

import ctypes
import hashlib

from llvmlite import binding as llvm

from robsim.kernels.machine import cache_files, llvm_modules
from robsim.kernels.machine.code_archive import CodeArchive
from robsim.kernels.machine.deferred_calls import DeferredCall

# Allocation of arrays in stages. The header has the count of references and the address of the
# numbers where Numba's code reads them.
_RUNTIME = """
target triple = "TRIPLE"
target datalayout = "LAYOUT"
declare i8* @malloc(i64)
declare void @free(i8*)
define i8* @robsim.allocate(i64 %size, i32 %align) {
  %a = zext i32 %align to i64
  %more = add i64 %a, 64
  %all = add i64 %size, %more
  %m = call i8* @malloc(i64 %all)
  %none = icmp eq i8* %m, null
  br i1 %none, label %failed, label %found
failed:
  ret i8* null
found:
  %count = bitcast i8* %m to i64*
  store i64 1, i64* %count
  %first = ptrtoint i8* %m to i64
  %end = add i64 %first, %more
  %mask = sub i64 0, %a
  %numbers = and i64 %end, %mask
  %data = inttoptr i64 %numbers to i8*
  %place = getelementptr i8, i8* %m, i64 24
  %slot = bitcast i8* %place to i8**
  store i8* %data, i8** %slot
  ret i8* %m
}
define void @robsim.release(i8* %m) {
  call void @free(i8* %m)
  ret void
}
@robsim.failures = global i32 0
define void @robsim.fail(i32 %status) {
  %before = atomicrmw add i32* @robsim.failures, i32 1 monotonic
  ret void
}
define void @robsim.failing_stage(i64* %p, double* %w, i64 %step) {
  call void @robsim.fail(i32 1)
  ret void
}
"""
_OWN = {"robsim.allocate", "robsim.release", "robsim.fail"}


class CodeEngine:
    """LLVM's engine for machine code in memory.

    Attributes
    ----------
    failures : ctypes.c_int
        Number of stages that have failed.
    """

    def __init__(self) -> None:
        features = llvm.get_host_cpu_features().flatten()
        self.processor = llvm.get_host_cpu_name(), features
        self.machine = llvm_modules.make_target_machine(*self.processor)
        runtime = llvm_modules.parse_module(_RUNTIME.encode(), self.machine)
        self._engine = llvm.create_mcjit_compiler(runtime, self.machine)
        self._engine.finalize_object()
        self.failures = ctypes.c_int.from_address(
            self._engine.get_global_value_address("robsim.failures")
        )

    @property
    def failing_stage(self) -> int:
        """The address of a stage that fails."""
        return self._engine.get_function_address("robsim.failing_stage")  # type: ignore[no-any-return]

    def add_call(self, symbol: str, call: DeferredCall) -> None:
        """Register the machine code of a call with LLVM by the symbol of its stage."""
        self._engine.add_module(llvm_modules.parse_module(call.text.encode(), self.machine))
        self._engine.finalize_object()
        llvm.add_symbol(symbol, self._engine.get_function_address(call.name))

    def has_address(self, symbol: str) -> bool:
        """Return whether a symbol has an address; LLVM ends the process if it has none."""
        return symbol in _OWN or bool(llvm.address_of_symbol(symbol))

    @staticmethod
    def can_read(archive: CodeArchive) -> bool:
        """Return whether this LLVM is not earlier than the one that wrote an archive."""
        return archive.llvm <= llvm_modules.LLVM_VERSION[0]

    def load(self, symbol: str, archive: CodeArchive, is_bitcode: bool) -> int:
        """Load the code of a function; return its address, or 0 if this LLVM cannot read it."""
        code: bytes | None = archive.parts[symbol]
        if is_bitcode:
            code = self.translate(symbol, archive)
        if not code:
            return 0
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        return self._engine.get_function_address(symbol)  # type: ignore[no-any-return]

    def translate(self, symbol: str, archive: CodeArchive) -> bytes | None:
        """Return the machine code of bitcode, from the user's cache if it is there."""
        if not self.can_read(archive):
            return None
        name = symbol.removeprefix("robsim.robsim.kernels.")
        digest = hashlib.sha256(archive.parts[symbol]).hexdigest()
        key = (digest, llvm_modules.LLVM_VERSION, llvm_modules.TRIPLE, *self.processor)
        code = cache_files.read_object(name, key)
        if code is None:
            try:
                module = llvm_modules.parse_module(archive.parts[symbol], self.machine)
            except RuntimeError:  # an LLVM that cannot read the old bitcode
                return None
            llvm_modules.optimise(module, self.machine)
            code = self.machine.emit_object(module)
            cache_files.write_object(name, key, code)
        return code
