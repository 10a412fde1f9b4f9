"""Ctrl-C that sets a flag instead of raising KeyboardInterrupt somewhere."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def caught(stop: Callable[[], object]) -> Iterator[None]:
    """Call `stop` at each Ctrl-C within a `with` block, which raises no KeyboardInterrupt then.

    Nothing changes where none would be raised: in other threads than the main one, and where
    Ctrl-C is ignored or somebody else's.
    """
    if _handler() is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda *given: stop())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def is_others() -> bool:
    """Return whether Ctrl-C calls a function in this thread that raises who knows what."""
    handler = _handler()
    return callable(handler) and handler is not signal.default_int_handler


def _handler() -> Any:
    """Return what Ctrl-C does in this thread; None if nothing."""
    in_main = threading.current_thread() is threading.main_thread()
    return signal.getsignal(signal.SIGINT) if in_main else None


@contextmanager
def undisturbed() -> Iterator[list[Any]]:
    """Delay Ctrl-C within a `with` block: each one is put into the list that is yielded."""
    came: list[Any] = []
    with caught(lambda: came.append(signal.SIGINT)):
        yield came
