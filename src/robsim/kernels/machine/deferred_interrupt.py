"""Ctrl-C that waits for the compiler, which it would leave with half a kernel."""

import signal
import threading
from typing import Any

from numba.core import event


class DeferredInterrupt(event.Listener):
    """Listens to Numba, and lets KeyboardInterrupt wait while it compiles or loads kernels.

    It does so where Python's own handler is in force, and in the main thread, where handlers run. A
    handler that does so itself has a list `waiting` of signals, for which it is called afterwards.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._came = False

    def on_start(self, given: Any) -> None:
        """Take over Ctrl-C where the outermost kernel begins."""
        if threading.current_thread() is threading.main_thread():
            own = signal.getsignal(signal.SIGINT) is signal.default_int_handler
            if own and not self._depth:
                self._came = False
                signal.signal(signal.SIGINT, self._note)
            self._depth += 1  # last: the line before may raise what came before it

    def on_end(self, given: Any) -> None:
        """Give it back where that ends, and raise KeyboardInterrupt if it came."""
        if threading.current_thread() is not threading.main_thread():
            return
        self._depth -= 1
        if self._depth:
            return
        handler: Any = signal.getsignal(signal.SIGINT)
        if handler == self._note:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if self._came:
                raise KeyboardInterrupt
        for number in getattr(handler, "waiting", ())[:1]:
            handler(number, None)

    def _note(self, number: int, frame: Any) -> None:
        self._came = True
