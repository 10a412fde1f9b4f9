"""A node of ROS 2 as a process: its start, its executor and its end by a signal."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from robsim.base.errors import InputError
from robsim.ros2.middleware import limit_discovery, require_rclpy

ENDS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
STOPPING = 15.0  # seconds until a node that does not stop is left


@contextmanager
def join_ros(arguments: Sequence[str], network: bool) -> Iterator[str]:
    """Initialise rclpy within a block; the value is a sentence about the network.

    Signals keep their handlers: the caller stops the robot.

    Raises
    ------
    InputError
        If ROS 2 is not installed, or the arguments are not valid.
    """
    rclpy = require_rclpy()
    sentence = limit_discovery(network)
    none = import_module("rclpy.signals").SignalHandlerOptions.NO
    try:
        rclpy.init(args=["robsim", *arguments], signal_handler_options=none)
    except Exception as error:  # noqa: BLE001  rclpy has several classes of errors for arguments
        raise InputError(f"arguments of ROS: {error!s:.200}") from None
    try:
        yield sentence
    finally:
        rclpy.try_shutdown()


def spin_until_signal(node: Any, stop: Callable[[], None], ready: Callable[[], None]) -> int:
    """Execute a node until SIGINT, SIGTERM or SIGHUP, stop it, and return the signal.

    `ready` is called once the node is executed, and `stop` by the thread that executes it. Messages
    are taken by the executor of events, which has a shorter latency than the others of rclpy.
    """
    with _receive_signals() as receiver:
        executor = import_module("rclpy.experimental").EventsExecutor(context=node.context)
        executor.add_node(node)
        thread = threading.Thread(target=executor.spin, name="ros", daemon=True)
        thread.start()
        ready()
        number = receiver.recv(1)[0]
        stopped = threading.Event()

        def end() -> None:
            try:
                stop()
            finally:
                stopped.set()

        executor.create_task(end)
        stopped.wait(STOPPING)
        executor.shutdown()
        thread.join(1.0)
    return int(number)


@contextmanager
def _receive_signals() -> Iterator[socket.socket]:
    """Yield a socket that receives a byte for each signal, from any thread of the process.

    The number of the signal is the byte. Other threads of the process cannot interrupt a lock of
    the main thread, so the signal is not waited for with a lock.
    """
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    before = {number: signal.signal(number, lambda *_: None) for number in ENDS}
    wakeup = signal.set_wakeup_fd(sender.fileno())
    try:
        yield receiver
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            signal.signal(number, handler)
        receiver.close()
        sender.close()
