"""The state of a node as messages of diagnostic_msgs, where they are installed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robsim.ros2.middleware import find_message_type, make_ros_message

TOPIC, PERIOD = "/diagnostics", 1.0  # and seconds between two messages
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"  # of diagnostic_msgs/DiagnosticStatus


class DiagnosticPublisher:
    """A publisher of the state of a node on /diagnostics; without diagnostic_msgs it does nothing.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that publishes.
    """

    def __init__(self, node: Any) -> None:
        self._node, kind = node, find_message_type(DIAGNOSTICS)
        self._publisher = None if kind is None else node.create_publisher(kind, TOPIC, 10)

    def publish(self, level: bytes, text: str, values: Mapping[str, object]) -> None:
        """Publish the level of the state of the node, the state in words, and values by name."""
        if self._publisher is None:
            return
        pairs = [
            make_ros_message("diagnostic_msgs/msg/KeyValue", key=key, value=str(value))
            for key, value in values.items()
        ]
        name = self._node.get_name()
        status = make_ros_message(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=level,
            name=name,
            message=text,
            hardware_id="robsim",
            values=pairs,
        )
        message = make_ros_message(DIAGNOSTICS, status=[status])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
