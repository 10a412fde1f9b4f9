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

    Nothing changes where none would be raised: in other threads, and where Ctrl-C is ignored or
    does something else.
    """
    if not raises():
        yield
        return
    signal.signal(signal.SIGINT, lambda *given: stop())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def raises() -> bool:
    """Return whether Ctrl-C raises KeyboardInterrupt in this thread, as it usually does."""
    return _in_main() and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def is_own() -> bool:
    """Return whether Ctrl-C calls a function of somebody's own in this thread."""
    return _in_main() and callable(signal.getsignal(signal.SIGINT)) and not raises()


def _in_main() -> bool:
    return threading.current_thread() is threading.main_thread()


@contextmanager
def undisturbed() -> Iterator[list[Any]]:
    """Delay Ctrl-C within a `with` block: each one is put into the list that is yielded."""
    came: list[Any] = []
    with caught(lambda: came.append(signal.SIGINT)):
        yield came
