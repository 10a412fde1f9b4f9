"""A process with one node: its start, its signals and its end."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from robsim.ros2.middleware import limit_discovery, require_rclpy

SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
SERVICE_PERIOD = 0.02  # seconds between two looks at services and signals


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


def spin_until_signal(
    data: Any, services: Any, flag: StopFlag, watch: Callable[[], None], period: float
) -> None:
    """Execute two nodes until a signal asks for their end.

    The node of the data is served at once, the node of the services every `SERVICE_PERIOD`. `watch`
    is called at least once in a period in seconds.
    """
    single = import_module("rclpy.executors").SingleThreadedExecutor
    fast, slow = single(), single()
    fast.add_node(data)
    slow.add_node(services)
    served = 0.0
    while not flag.received:
        fast.spin_once(timeout_sec=min(period, SERVICE_PERIOD))
        watch()
        if time.monotonic() - served > SERVICE_PERIOD:
            slow.spin_once(timeout_sec=0.0)
            served = time.monotonic()
    fast.shutdown()
    slow.shutdown()
