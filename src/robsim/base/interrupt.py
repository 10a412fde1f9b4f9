"""Stops: Ctrl-C, and the signals by which a terminal or a system ends a process.

A stop raises KeyboardInterrupt, as Python's own handler does for Ctrl-C, where there is nothing to
be saved; but not within an import or a compiler, for which it waits. Once a run has begun, it
waits until a block that was `defer_stops` looks for it.
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
AGAIN = 0.05  # seconds, after which a stop comes again that met an import or a compiler
LEAVING = 2.0  # seconds, for which a stop that was raised has its way out to itself
_BUSY = {"importlib", "numba", "llvmlite"}


class _Deferral:
    """A block in which stops wait, and those inside of it."""

    def __init__(
        self, outer: _Deferral | None, stop: Callable[[], object], begun: bool, deaf: bool
    ):
        self.root: _Deferral = outer.root if outer else self
        self.came: list[int] = outer.came if outer else []
        self.deaf: bool = deaf or (outer is not None and outer.deaf)
        inner = () if self.deaf else (stop,)
        self.stops: tuple[Callable[[], object], ...] = (*(outer.stops if outer else ()), *inner)
        self.begun = begun  # of the root alone


class _StopState:
    """What this process knows of stops; its handlers run in the main thread."""

    hold: _Deferral | None = None
    first = int(signal.SIGINT)
    listening = False
    waiting: ClassVar[list[int]] = []  # stops, until an import or a compiler has ended
    raised = -LEAVING  # when, by the monotonic clock


@contextmanager
def defer_stops(
    stop: Callable[[], object] = lambda: None, *, begun: bool = True, deaf: bool = False
) -> Iterator[list[int]]:
    """Let stops wait within a `with` block, and yield the list into which they are put.

    The first one calls `stop`, and so does a block that is entered after it; the others only say
    that what was done is being saved. `begun=False`: until a block inside has begun, there is
    nothing to be saved. `deaf`: what is inside goes on to its end, and the list stays empty.

    Nothing changes in other threads than the main one, and where a signal is ignored or somebody
    else's.
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
        if own.came and not own.deaf:
            stop()
        yield [] if own.deaf else own.came
    finally:
        _StopState.hold = outer
        for number, handler in mine.items():
            signal.signal(number, handler)


@contextmanager
def listen_for_stops() -> Iterator[None]:
    """Take over the stops of a process that is the command line, from its first to its last line.

    Afterwards they are ignored: there is nothing left but Python's own end.
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
    """Raise KeyboardInterrupt now if a stop came during an import that is over."""
    for number in _StopState.waiting[:1]:
        _handle_signal(number, None)


def get_exit_status() -> int:
    """Return the exit status of a process that was stopped: the shell's number for the signal."""
    return 128 + _StopState.first


def has_foreign_handler() -> bool:
    """Return whether Ctrl-C calls a function in this thread that raises who knows what."""
    in_main = threading.current_thread() is threading.main_thread()
    handler = signal.getsignal(signal.SIGINT) if in_main else None
    return (
        callable(handler)
        and not _is_default_handler(signal.SIGINT, handler)
        and handler != _handle_signal
    )


def _is_default_handler(number: int, handler: Any) -> bool:
    """Return whether a handler is that which Python has at its start."""
    if number == signal.SIGINT:
        return handler is signal.default_int_handler
    return bool(handler == signal.SIG_DFL)


def _handle_signal(number: int, frame: FrameType | None) -> None:
    """Take a stop."""
    if number in _StopState.waiting:
        _StopState.waiting.remove(number)
    hold = _StopState.hold
    if hold is None or not hold.root.begun:
        _raise_interrupt(number, frame)
        return
    hold.came.append(number)
    if len(hold.came) > 1:
        _write_to_stderr("saving what was simulated so far")
        return
    _StopState.first = number
    for stop in hold.stops:
        stop()


def _raise_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, as soon as that can be; a script ends by other signals as ever."""
    if number != signal.SIGINT and not _StopState.listening:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
    elif _is_uninterruptible(frame):
        _resend_later(number)
    elif time.monotonic() - _StopState.raised > LEAVING:
        _StopState.raised, _StopState.first = time.monotonic(), number
        raise KeyboardInterrupt


def _is_uninterruptible(frame: FrameType | None) -> bool:
    """Return whether an import or a compiler is at work, which an exception would break."""
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
    if hasattr(signal, "pthread_kill") and main:  # wakes it, too
        signal.pthread_kill(main, number)
    else:
        signal.raise_signal(number)


def _handle_unraisable(what: Any) -> None:
    """Let a stop come again that was raised where Python lets nothing be raised."""
    if isinstance(what.exc_value, KeyboardInterrupt):
        _StopState.raised = -LEAVING
        _resend_later(_StopState.first)
    else:
        sys.__unraisablehook__(what)


def _write_to_stderr(text: str) -> None:
    """Write a line on stderr, past its buffer, in which the main thread may be writing."""
    with suppress(OSError, ValueError, AttributeError):
        os.write(sys.stderr.fileno(), f"robsim: {text}\n".encode())
