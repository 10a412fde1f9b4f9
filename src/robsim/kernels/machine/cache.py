"""What Numba asks for the machine code of a kernel: what came with the package, or was kept.

Numba's own cache does not notice an edit in a callee of another file, asks for the place where
the package lies and for the name of the processor, and believes whatever it reads.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.compiler import CompileResult

from robsim.kernels.machine import aged, cache_files, prebuilt, sources, stderr_messages
from robsim.kernels.machine.compile_lock import CompileLock

LINKED: dict[str, Any] = {}  # the stages that kernels may call, by their symbols
_CLEARED: set[Path] = set()  # the folder, once this process has cleared it


class KernelCache:
    """The machine code of one kernel, a file for each list of argument types."""

    def __init__(self, function: Callable[..., Any]):
        code = function.__code__
        file = Path(code.co_filename).stem
        self.name = f"{file}.{function.__qualname__}-{code.co_firstlineno}".replace("<locals>", "")
        self.module = function.__module__ or ""  # None of what `exec` made
        self.free = [_describe_value(cell.cell_contents) for cell in function.__closure__ or ()]
        self.cache_path = str(cache_files.CACHE)  # which Numba shows in `stats`
        self._claims: dict[Any, CompileLock] = {}  # to compile it for some argument types

    @property
    def sources(self) -> str:
        """The digest of its own file and all that it imports; "" where there is no file."""
        return sources.digest_of(self.module)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled kernel for some argument types; None if it is nowhere.

        It is nowhere once this process has the claim to compile it: where another process compiles
        it at this moment, its file is waited for.
        """
        if not self.sources:
            return None
        _clear_once()
        target_context.refresh()
        host = target_context.codegen().magic_tuple()
        found = self._found(sig, host, target_context)
        if found is None:
            key = (sig, host, self.sources, self.free)
            self._claims[sig] = claim = CompileLock(
                cache_files.CACHE / cache_files.code_file_name(self.name, key)
            )
            if claim.waited:
                found = self._found(sig, host, target_context)
        return found

    def _found(self, sig: Any, host: tuple[str, ...], target_context: Any) -> Any:
        """Return the compiled kernel that came with the package or was kept; None if none did.

        A file that is damaged is as none, whatever Python and Numba make of it.
        """
        places = [(prebuilt.FOLDER, (host[0], prebuilt.LEVEL, ""))] if prebuilt.FOLDER else []
        for folder, processor in (*places, (cache_files.CACHE, host)):
            key = (sig, processor, self.sources, self.free)
            try:
                found = self._loaded(folder, key, target_context)
            except MemoryError:
                raise
            except Exception:  # noqa: BLE001  of which a wrong file may raise any
                cache_files.drop_code(folder, self.name, key)
            else:
                if found is not None:
                    return found
        return None

    def _loaded(self, folder: Path, key: tuple[Any, ...], target_context: Any) -> Any:
        found = cache_files.load_code(folder, self.name, key)
        if found is None:
            return None
        aged.note_use(folder / cache_files.code_file_name(self.name, key))
        symbols, made = found
        for symbol in symbols:
            LINKED[symbol].link()  # else LLVM would end the process
        return CompileResult._rebuild(target_context, *made)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled kernel; without a place to write it serves this process alone."""
        if not self.sources:
            return
        key = (sig, data.library.codegen.magic_tuple(), self.sources, self.free)
        code = data.library._final_module
        symbols = [f.name for f in code.functions if f.is_declaration and f.name in LINKED]
        try:
            cache_files.save_code(cache_files.CACHE, self.name, key, (symbols, data._reduce()))
        except OSError as error:
            stderr_messages.report_unkept_kernels(
                f"{cache_files.CACHE} cannot be written ({error.strerror or error})"
            )
        finally:
            self._claims.pop(sig, None)
        _clear_once()

    def flush(self) -> None:
        """Keep what there is, which Numba asks to forget when it compiles a function again."""


def _describe_value(value: Any) -> str:
    """Return what a free variable of a function is; a kernel by its name, not its address."""
    own = getattr(value, "_cache", None)
    return f"{own.name} {own.sources} {own.free}" if isinstance(own, KernelCache) else repr(value)


def _clear_once() -> None:
    """Clear the folder once in a process."""
    if cache_files.CACHE not in _CLEARED:
        _CLEARED.add(cache_files.CACHE)
        aged.clear_old_files(cache_files.CACHE)
