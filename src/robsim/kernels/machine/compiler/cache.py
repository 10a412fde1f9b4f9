"""The cache of the machine code that Numba makes.

It replaces Numba's own cache for three reasons. Numba's cache does not detect an edit in a callee
of another file, its keys contain the path of the package and the name of the processor, and it
does not verify the files that it reads. Code that was not used for a month is deleted.
"""

import math
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core.compiler import CompileResult

from robsim.kernels.machine import cache_files, sources, stderr_messages
from robsim.kernels.machine.compiler.compile_lock import CompileLock
from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.kernel import Kernel
from robsim.kernels.machine.machine_code import LINKED, link_symbol

DAY, MONTH = 86400.0, 30 * 86400.0  # seconds
LONGEST_WRITE = 600.0  # seconds: an older draft or lock belongs to a process that was killed
STAMP = "used"  # file: its modification time is the time of the last cleanup

_CLEARED: set[Path] = set()  # the folders that this process has cleaned


class KernelCache:
    """The machine code of one kernel, with a file for each list of argument types."""

    def __init__(self, function: Callable[..., Any]):
        code = function.__code__
        file = Path(code.co_filename).stem
        self.name = f"{file}.{function.__qualname__}-{code.co_firstlineno}".replace("<locals>", "")
        self.module = function.__module__ or ""  # __module__ is None for functions of `exec`
        self.free = [_describe_value(cell.cell_contents) for cell in function.__closure__ or ()]
        self.cache_path = str(cache_files.CACHE)  # Numba shows it in `stats`
        self._claims: dict[Any, CompileLock] = {}  # argument types: lock of their compilation

    @property
    def sources(self) -> str:
        """The digest of the kernel's file and of all imported sources; "" without a file."""
        return sources.digest_of(self.module)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled kernel for some argument types, or None if this process compiles it.

        If another process compiles the kernel at this moment, wait for its file. Before None is
        returned, this process has acquired the lock to compile the kernel.
        """
        if not self.sources:
            return None
        _clear_once()
        target_context.refresh()
        host = target_context.codegen().magic_tuple()
        compiled = self._search(sig, host, target_context)
        if compiled is None:
            key = (sig, host, self.sources, self.free)
            claim = CompileLock(cache_files.CACHE / cache_files.code_file_name(self.name, key))
            if claim.waited:
                compiled = self._search(sig, host, target_context)
            if compiled is None:
                self._claims[sig] = claim
        return compiled

    def _search(self, sig: Any, host: tuple[str, ...], target_context: Any) -> Any:
        """Return the compiled kernel from the user's cache, or None. Delete a damaged file."""
        key = (sig, host, self.sources, self.free)
        try:
            return self._load(key, target_context)
        except MemoryError:
            raise
        except Exception:  # noqa: BLE001  a damaged file may raise any exception
            cache_files.drop_code(self.name, key)
            return None

    def _load(self, key: tuple[Any, ...], target_context: Any) -> Any:
        """Return the compiled kernel of a file, or None if the file does not exist."""
        content = cache_files.load_code(self.name, key)
        if content is None:
            return None
        note_use(cache_files.CACHE / cache_files.code_file_name(self.name, key))
        symbols, reduced = content
        for symbol in symbols:
            link_symbol(symbol)  # LLVM ends the process if a symbol is undefined
        return CompileResult._rebuild(target_context, *reduced)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save a compiled kernel. If the cache is not writable, only this process can use it."""
        if not self.sources:
            return
        key = (sig, data.library.codegen.magic_tuple(), self.sources, self.free)
        code = data.library._final_module
        symbols = [f.name for f in code.functions if f.is_declaration and f.name in LINKED]
        try:
            cache_files.save_code(self.name, key, (symbols, data._reduce()))
        except OSError as error:
            stderr_messages.report_uncached_kernels(
                f"{cache_files.CACHE} cannot be written ({error.strerror or error})"
            )
        finally:
            self._claims.pop(sig, None)
        _clear_once()

    def flush(self) -> None:
        """Keep all files. Numba calls this method when it compiles a function again."""


def _describe_value(value: Any) -> str:
    """Return a text for the value of a free variable. It names a kernel without its address."""
    if isinstance(value, Intrinsic):
        return f"{value!r} {[*map(_describe_value, value.arguments)]}"
    own = getattr(value.dispatcher if isinstance(value, Kernel) else value, "_cache", None)
    return f"{own.name} {own.sources} {own.free}" if isinstance(own, KernelCache) else repr(value)


def _clear_once() -> None:
    """Clean the cache folder once in a process."""
    if cache_files.CACHE not in _CLEARED:
        _CLEARED.add(cache_files.CACHE)
        clear_old_files(cache_files.CACHE)


def note_use(file: Path) -> None:
    """Set the modification time of a used file, at most once a day, if it is writable."""
    with suppress(OSError):
        if time.time() - file.stat().st_mtime > DAY:
            os.utime(file)


def clear_old_files(folder: Path) -> None:
    """Delete the old cache files of a folder, at most once a day. Keep all other files."""
    now = time.time()
    with suppress(OSError):
        if abs(now - (folder / STAMP).stat().st_mtime) < DAY:
            return
    with suppress(OSError):
        if folder.is_dir():
            (folder / STAMP).touch()
            for each in os.scandir(folder):
                _delete_if_old(each, now)


def _delete_if_old(each: "os.DirEntry[str]", now: float) -> None:
    """Delete a cache file if its age exceeds the limit of its suffix."""
    limits = {".nbc": MONTH, ".tmp": LONGEST_WRITE, ".lock": LONGEST_WRITE}
    limit = limits.get(Path(each.name).suffix, math.inf)
    with suppress(OSError):
        is_old = now - each.stat(follow_symlinks=False).st_mtime > limit
        if is_old and each.is_file(follow_symlinks=False):
            os.unlink(each.path)
