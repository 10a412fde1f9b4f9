"""Ctrl-C, delayed until a piece of work is finished."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def undisturbed() -> Iterator[list[Any]]:
    """Delay Ctrl-C within a `with` block: each one is put into the list that is yielded."""
    came: list[Any] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    before = signal.signal(signal.SIGINT, lambda *given: came.append(given))
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, before)
