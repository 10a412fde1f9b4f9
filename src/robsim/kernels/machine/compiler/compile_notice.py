"""A line on stderr if compilation takes more than a second, and its progress on a terminal."""

import sys
import threading
import time
from typing import Any

from numba.core import event

from robsim.kernels.machine import cache_files, code_archive, stderr_messages
from robsim.kernels.machine.compiler.cache import KernelCache
from robsim.kernels.machine.sources import digest_of_all

PATIENCE = 1.0  # seconds of compilation in this process before the first line


class CompileNotice(event.Listener):
    """A listener to Numba's events that counts compiled kernels and reports progress.

    Numba compiles under one lock, so two threads never call the listener at the same time. The
    compilation of a callee is nested in the compilation of its caller.
    """

    def __init__(self) -> None:
        self.compiled: list[str] = []
        self.seconds = 0.0  # compilation time before the current outermost kernel
        self._stack: list[tuple[str, float]] = []
        self._has_reported = False
        self._lock = threading.Lock()  # guards the output
        self._timer = threading.Timer(0, self._show)

    def on_start(self, occurrence: event.Event) -> None:
        """Record the start of a kernel. Start the timer with the outermost kernel."""
        name = _kernel_name(occurrence)
        if not name:
            return
        self._stack.append((name, time.perf_counter()))
        if self._has_reported:
            self._show()
        elif len(self._stack) == 1:
            self._timer = threading.Timer(max(PATIENCE - self.seconds, 0), self._show)
            self._timer.daemon = True
            self._timer.start()

    def on_end(self, occurrence: event.Event) -> None:
        """Record the end of a kernel. Erase the progress line after the outermost kernel."""
        if not _kernel_name(occurrence):
            return
        name, began = self._stack.pop()
        self.compiled.append(name)
        if not self._stack:
            self._timer.cancel()
            self.seconds += time.perf_counter() - began
            with self._lock:
                if self._has_reported:
                    _rewrite_line("")

    def _show(self) -> None:
        """Write the number of compiled kernels and the current kernel, after the first line."""
        with self._lock:
            stack = self._stack[:]  # the compiling thread may change the stack meanwhile
            if stderr_messages.is_quiet() or not stack:
                return
            if not self._has_reported:
                self._has_reported = True
                _report_cache_folder()
            seconds = self.seconds + time.perf_counter() - stack[0][1]
            _rewrite_line(f"{len(self.compiled)} kernels in {seconds:.0f} s, now {stack[-1][0]}")


def _kernel_name(occurrence: event.Event) -> str:
    """Return the name of a kernel, such as "loop.settle"; "" for functions of other packages."""
    own = getattr(occurrence.data["dispatcher"], "_cache", None)
    return own.name.rpartition("-")[0] if isinstance(own, KernelCache) else ""


def _report_cache_folder() -> None:
    """Write the line that names the cache folder, or the reason why kernels are not cached."""
    why = f" ({why})" if (why := code_archive.explain_mismatch(digest_of_all())) else ""
    if cache_files.is_cache_writable():
        stderr_messages.write_stderr(
            f"robsim: compiling kernels, once: they are kept in {cache_files.CACHE}{why}\n"
        )
    else:
        stderr_messages.report_uncached_kernels(f"{cache_files.CACHE} cannot be written{why}")


def _rewrite_line(text: str) -> None:
    """Overwrite the progress line if stderr is a terminal or a notebook."""
    stream: Any = sys.stderr
    if stream and (stream.isatty() or type(stream).__module__.startswith("ipykernel")):
        stderr_messages.write_stderr(f"\r{text[:78]:78}" + ("" if text else "\r"))


NOTICE = CompileNotice()
