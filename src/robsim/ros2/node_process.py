"""A process with one node: its start, its signals and its end."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from robsim.ros2.middleware import limit_discovery, require_rclpy

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


STOPPING = 15.0  # seconds until a node that does not stop is left


class StopFlag:
    """The first signal that asks the process to end, if there was one.

    The second signal ends the process at once.
    """

    def __init__(self) -> None:
        self.received = ""

    def __call__(self, number: int, frame: object) -> None:
        """Store a signal, as a signal handler."""
        self.received = signal.Signals(number).name
        signal.signal(number, signal.SIG_DFL)


@contextmanager
def open_ros(arguments: Sequence[str], network: bool) -> Iterator[tuple[Any, StopFlag, str]]:
    """Initialise ROS 2, and yield rclpy, the flag of signals, and a sentence on the network.

    Signals are stored in the flag, so that the program decides how it ends.
    """
    rclpy = require_rclpy()
    reach, stop = limit_discovery(network), StopFlag()
    no_handlers = rclpy.signals.SignalHandlerOptions.NO
    rclpy.init(args=["robsim", *arguments], signal_handler_options=no_handlers)
    before = {number: signal.signal(number, stop) for number in SIGNALS}
    try:
        yield rclpy, stop, reach
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        rclpy.try_shutdown()


def spin_until_signal(node: Any, flag: StopFlag, stop: Callable[[], None]) -> None:
    """Execute a node until a signal asks for its end, and stop it.

    `stop` is called by the thread that executes the node. Messages are taken by the executor of
    events, whose latency is shorter than the latency of the others of rclpy. The main thread sleeps
    until a signal, so that it takes no time from the executor.
    """
    executor = import_module("rclpy.experimental").EventsExecutor(context=node.context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, name="ros", daemon=True)
    with _receive_signals() as receiver:
        thread.start()
        _perform(executor, lambda: None)
        for number in SIGNALS:  # again: the executor has replaced the handlers at its start
            signal.signal(number, flag)
        if not flag.received:
            receiver.recv(1)
        _perform(executor, stop)
        executor.shutdown()
        thread.join(1.0)


def _perform(executor: Any, call: Callable[[], None]) -> None:
    """Call a function in the thread of an executor, and wait for its end."""
    done = threading.Event()

    def perform() -> None:
        try:
            call()
        finally:
            done.set()

    executor.create_task(perform)
    done.wait(STOPPING)


@contextmanager
def _receive_signals() -> Iterator[socket.socket]:
    """Yield a socket that receives a byte for each signal, from any thread of the process."""
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    before = signal.set_wakeup_fd(sender.fileno())
    try:
        yield receiver
    finally:
        signal.set_wakeup_fd(before)
        receiver.close()
        sender.close()
