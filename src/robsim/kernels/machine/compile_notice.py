"""A line on stderr where compiling takes more than a second, and its progress on a terminal."""

import sys
import threading
import time
from typing import Any

from numba.core import event

from robsim.kernels.machine import cache_files, prebuilt, stderr_messages
from robsim.kernels.machine.cache import KernelCache

PATIENCE = 1.0  # seconds of compiling in this process, before which nothing is said


class CompileNotice(event.Listener):
    """Listens to Numba; counts the kernels that it compiles, and says so.

    Numba compiles under one lock, so that no two threads call this at the same time; kernels that
    are called by others are compiled inside of these.
    """

    def __init__(self) -> None:
        self.compiled: list[str] = []
        self.seconds = 0.0  # of compiling, until the outermost kernel at work now was begun
        self._stack: list[tuple[str, float]] = []
        self._told = False
        self._lock = threading.Lock()  # of what is written
        self._timer = threading.Timer(0, self._show)

    def on_start(self, given: event.Event) -> None:
        """Begin a kernel, and a clock with the outermost."""
        name = _kernel_name(given)
        if not name:
            return
        self._stack.append((name, time.perf_counter()))
        if self._told:
            self._show()
        elif len(self._stack) == 1:
            self._timer = threading.Timer(max(PATIENCE - self.seconds, 0), self._show)
            self._timer.daemon = True
            self._timer.start()

    def on_end(self, given: event.Event) -> None:
        """End a kernel; nothing stays on a terminal but the first line."""
        if not _kernel_name(given):
            return
        name, began = self._stack.pop()
        self.compiled.append(name)
        if not self._stack:
            self._timer.cancel()
            self.seconds += time.perf_counter() - began
            with self._lock:
                if self._told:
                    _rewrite_line("")

    def _show(self) -> None:
        """Say what is compiled now, after a first line once in this process."""
        with self._lock:
            stack = self._stack[:]  # which the thread that compiles may change meanwhile
            if stderr_messages.is_quiet() or not stack:
                return
            if not self._told:
                self._told = True
                _report_cache_folder()
            seconds = self.seconds + time.perf_counter() - stack[0][1]
            _rewrite_line(f"{len(self.compiled)} kernels in {seconds:.0f} s, now {stack[-1][0]}")


def _kernel_name(given: event.Event) -> str:
    """Return the name of a kernel, such as "loop.settle"; empty for others' functions."""
    own = getattr(given.data["dispatcher"], "_cache", None)
    return own.name.rpartition("-")[0] if isinstance(own, KernelCache) else ""


def _report_cache_folder() -> None:
    why = f" ({why})" if (why := prebuilt.explain_mismatch()) else ""
    if cache_files.is_cache_writable():
        stderr_messages.write_stderr(
            f"robsim: compiling kernels, once: they are kept in {cache_files.CACHE}{why}\n"
        )
    else:
        stderr_messages.report_unkept_kernels(f"{cache_files.CACHE} cannot be written{why}")


def _rewrite_line(text: str) -> None:
    """Write over the line, where one can: on a terminal, and in a notebook."""
    stream: Any = sys.stderr
    if stream and (stream.isatty() or type(stream).__module__.startswith("ipykernel")):
        stderr_messages.write_stderr(f"\r{text[:78]:78}" + ("" if text else "\r"))


NOTICE = CompileNotice()
