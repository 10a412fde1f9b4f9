"""ROS 2 as it is installed: its client library, its message types and its network."""

from __future__ import annotations

import os
from array import array
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

from robsim.base.errors import InputError
from robsim.run.ros_connection import MARK_TYPES, RosConnection

RANGE, LOCAL = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"
LATCHED_DEPTH = 100  # messages kept for late subscribers: each on /tf_static has other frames
MISSING = (
    "ROS 2 is not installed in this Python: pip install 'robsim[ros2]' (Python 3.11 to 3.13), or "
    "source the setup.bash of an installation"
)


def require_rclpy() -> Any:
    """Return the module rclpy; raise InputError if ROS 2 is not installed.

    >>> from robsim.ros2 import middleware
    >>> middleware.MISSING.partition(":")[0]
    'ROS 2 is not installed in this Python'
    """
    try:
        return import_module("rclpy")
    except ImportError:
        raise InputError(MISSING) from None


def limit_discovery(network: bool) -> str:
    """Keep nodes on this machine unless they may use the network, and return a sentence about it.

    Call it before `rclpy.init`. Variables of the environment that the user has set stay.
    """
    if network:
        os.environ[RANGE] = "SUBNET"
        return "nodes on other machines of the network are reached"
    for name in (RANGE, "ROS_LOCALHOST_ONLY"):
        if name in os.environ:
            return f"the network is as {name}={os.environ[name]} of the environment sets it"
    os.environ[RANGE] = LOCAL
    return "only nodes on this machine are reached; --network reaches others"


@cache
def find_message_type(kind: str) -> Any:
    """Return the class of a message or service type, such as "std_msgs/msg/Bool", or None.

    >>> find_message_type("no_msgs/msg/Nothing") is None
    True
    """
    package, part, name = kind.split("/")
    try:
        return getattr(import_module(f"{package}.{part}"), name)
    except (ImportError, AttributeError):
        return None


def load_message_type(kind: str) -> Any:
    """Return the class of a message or service type; raise InputError if it is not installed."""
    found = find_message_type(kind)
    if found is None:
        raise InputError(f"the type {kind} of ROS 2 is not installed in this Python")
    return found


def make_ros_message(kind: str, **fields: Any) -> Any:
    """Return a message of rclpy with fields.

    Arrays become lists, as rclpy requires, and bytes an array of Python, which it takes as it is.
    """
    plain = {name: _convert_array(value) for name, value in fields.items()}
    return load_message_type(kind)(**plain)


def _convert_array(value: Any) -> Any:
    """Return an array as a field of a message; other values are unchanged."""
    if not isinstance(value, np.ndarray):
        return value
    return array("B", value.tobytes()) if value.dtype == np.uint8 else value.tolist()


def choose_mark_type(connection: RosConnection) -> str:
    """Return the type of the marks of a connection; arrays, if detections are not installed."""
    kind = connection.marks_type
    absent = kind == MARK_TYPES[0] and find_message_type(kind) is None
    return MARK_TYPES[1] if absent else kind


def create_data_node(name: str) -> Any:
    """Return a node for measurements and commands alone, without the services of other nodes.

    An executor of rclpy looks at every entity of its nodes before each message: with the services
    of a lifecycle node this takes half a millisecond.
    """
    create = import_module("rclpy").create_node
    return create(name, enable_rosout=False, start_parameter_services=False)


def make_listening_qos(complete: bool = False) -> Any:
    """Return the quality of service of a subscriber, which fits every publisher.

    A subscriber that needs every message, `complete`, fits reliable publishers only.
    """
    qos = import_module("rclpy.qos")
    policies = qos.ReliabilityPolicy
    reliability = policies.RELIABLE if complete else policies.BEST_EFFORT
    return qos.QoSProfile(depth=100 if complete else 10, reliability=reliability)


def make_latched_qos(depth: int = LATCHED_DEPTH) -> Any:
    """Return the quality of service of messages that late subscribers receive too."""
    qos = import_module("rclpy.qos")
    return qos.QoSProfile(depth=depth, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL)
