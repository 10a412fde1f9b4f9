"""Deferral of Ctrl-C until a compiler is in a consistent state."""

import signal
import threading
from typing import Any


class DeferredInterrupt:
    """A block that defers KeyboardInterrupt while kernels compile or load. Blocks may be nested.

    It acts in the main thread, where signal handlers run, if Python's default handler is in force.
    A custom handler can defer signals itself: it collects them in a list `waiting`, and the
    block calls the handler afterwards.
    """

    _depth = 0
    _is_interrupted = False

    def __enter__(self) -> None:
        """Replace the handler of SIGINT when the outermost block starts."""
        if threading.current_thread() is threading.main_thread():
            is_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
            if is_default and not self._depth:
                self._is_interrupted = False
                signal.signal(signal.SIGINT, self._note)
            self._depth += 1  # last, as signal.signal may raise an earlier KeyboardInterrupt

    def __exit__(self, *error: object) -> None:
        """Restore the handler after the outermost block. Raise KeyboardInterrupt if deferred."""
        if threading.current_thread() is not threading.main_thread():
            return
        self._depth -= 1
        if self._depth:
            return
        handler: Any = signal.getsignal(signal.SIGINT)
        if handler == self._note:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if self._is_interrupted:
                raise KeyboardInterrupt
        for number in getattr(handler, "waiting", ())[:1]:
            handler(number, None)

    def _note(self, number: int, frame: Any) -> None:
        self._is_interrupted = True


DEFERRED_INTERRUPT = DeferredInterrupt()
