"""Stops: Ctrl-C, and the signals that end a process.

A stop raises KeyboardInterrupt, as Python does for Ctrl-C, if there are no results to be saved.
During an import or a compilation it waits for their end. After a run has begun, a stop waits until
the code in a `defer_stops` block checks for it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, ClassVar

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
AGAIN = 0.05  # seconds until a stop during an import or a compilation is repeated
LEAVING = 2.0  # seconds after a raised stop while further stops are ignored
_BUSY = {"importlib", "numba", "llvmlite"}


class _Deferral:
    """A block that defers stops, with the inner blocks."""

    def __init__(
        self, outer: _Deferral | None, stop: Callable[[], object], begun: bool, deaf: bool
    ):
        self.root: _Deferral = outer.root if outer else self
        self.stops_received: list[int] = outer.stops_received if outer else []
        self.ignores_stops: bool = deaf or (outer is not None and outer.ignores_stops)
        inner = () if self.ignores_stops else (stop,)
        self.stops: tuple[Callable[[], object], ...] = (*(outer.stops if outer else ()), *inner)
        self.begun = begun  # used in the root only


class _StopState:
    """The state of stops in this process. The handlers run in the main thread."""

    hold: _Deferral | None = None
    first = int(signal.SIGINT)
    listening = False
    waiting: ClassVar[list[int]] = []  # stops until the end of an import or a compilation
    raised = -LEAVING  # time of the last raised stop, by the monotonic clock


@contextmanager
def defer_stops(
    stop: Callable[[], object] = lambda: None, *, begun: bool = True, deaf: bool = False
) -> Iterator[list[int]]:
    """Defer stops within a `with` block, and yield the list of the stops that came.

    The first stop calls `stop`, and so does the entry of a block after it. Further stops only print
    that the results are being saved. With `begun=False` there is nothing to save until an inner
    block has begun. With `deaf` the block runs to its end, and the list stays empty.

    Stops are not deferred in other threads than the main thread, nor for ignored signals and
    foreign handlers.
    """
    if threading.current_thread() is not threading.main_thread():
        yield []
        return
    outer = _StopState.hold
    own = _Deferral(outer, stop, begun, deaf)
    before = {} if outer else {number: signal.getsignal(number) for number in SIGNALS}
    mine = {
        number: handler
        for number, handler in before.items()
        if _is_default_handler(number, handler)
    }
    try:
        _StopState.hold = own
        for number in mine:
            signal.signal(number, _handle_signal)
        own.root.begun |= begun
        if own.stops_received and not own.ignores_stops:
            stop()
        yield [] if own.ignores_stops else own.stops_received
    finally:
        _StopState.hold = outer
        for number, handler in mine.items():
            signal.signal(number, handler)


@contextmanager
def listen_for_stops() -> Iterator[None]:
    """Handle the stops of a command-line process, from its first to its last line.

    After the block stops are ignored, because only the exit of Python is left.
    """
    mine = [number for number in SIGNALS if _is_default_handler(number, signal.getsignal(number))]
    _StopState.first, _StopState.raised = int(signal.SIGINT), -LEAVING
    _StopState.listening, hook, sys.unraisablehook = True, sys.unraisablehook, _handle_unraisable
    for number in mine:
        signal.signal(number, _handle_signal)
    try:
        yield
    finally:
        for number in mine:
            signal.signal(number, signal.SIG_IGN)
        _StopState.listening, sys.unraisablehook = False, hook


def raise_pending_stop() -> None:
    """Raise KeyboardInterrupt if a stop came during an import that has ended."""
    for number in _StopState.waiting[:1]:
        _handle_signal(number, None)


def get_exit_status() -> int:
    """Return the exit status of a stopped process: the shell's number of the signal."""
    return 128 + _StopState.first


def has_foreign_handler() -> bool:
    """Return whether Ctrl-C calls a foreign handler in this thread, which may raise anything."""
    in_main = threading.current_thread() is threading.main_thread()
    handler = signal.getsignal(signal.SIGINT) if in_main else None
    return (
        callable(handler)
        and not _is_default_handler(signal.SIGINT, handler)
        and handler != _handle_signal
    )


def _is_default_handler(number: int, handler: Any) -> bool:
    """Return whether a handler is Python's default."""
    if number == signal.SIGINT:
        return handler is signal.default_int_handler
    return bool(handler == signal.SIG_DFL)


def _handle_signal(number: int, frame: FrameType | None) -> None:
    """Handle a stop."""
    if number in _StopState.waiting:
        _StopState.waiting.remove(number)
    hold = _StopState.hold
    if hold is None or not hold.root.begun:
        _raise_interrupt(number, frame)
        return
    hold.stops_received.append(number)
    if len(hold.stops_received) > 1:
        _write_to_stderr("saving what was simulated so far")
        return
    _StopState.first = number
    for stop in hold.stops:
        stop()


def _raise_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt as soon as possible.

    Outside of the command line, other signals than Ctrl-C have their default effect.
    """
    if number != signal.SIGINT and not _StopState.listening:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
    elif _is_uninterruptible(frame):
        _resend_later(number)
    elif time.monotonic() - _StopState.raised > LEAVING:
        _StopState.raised, _StopState.first = time.monotonic(), number
        raise KeyboardInterrupt


def _is_uninterruptible(frame: FrameType | None) -> bool:
    """Return whether an import or a compiler is running, which an exception would break."""
    while frame:
        if str(frame.f_globals.get("__name__", "")).partition(".")[0] in _BUSY:
            return True
        frame = frame.f_back
    return False


def _resend_later(number: int) -> None:
    _StopState.waiting.append(number)
    timer = threading.Timer(AGAIN, _send_signal, (number,))
    timer.daemon = True
    timer.start()


def _send_signal(number: int) -> None:
    main = threading.main_thread().ident
    if number not in _StopState.waiting:
        return
    if hasattr(signal, "pthread_kill") and main:  # also wakes the main thread
        signal.pthread_kill(main, number)
    else:
        signal.raise_signal(number)


def _handle_unraisable(unraisable: Any) -> None:
    """Repeat a stop that was raised in a place where Python ignores exceptions."""
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        _StopState.raised = -LEAVING
        _resend_later(_StopState.first)
    else:
        sys.__unraisablehook__(unraisable)


def _write_to_stderr(text: str) -> None:
    """Write a line to stderr, bypassing its buffer, which the main thread may be using."""
    with suppress(OSError, ValueError, AttributeError):
        os.write(sys.stderr.fileno(), f"robsim: {text}\n".encode())
