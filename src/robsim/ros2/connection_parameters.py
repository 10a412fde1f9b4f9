"""The connection of a node as parameters of ROS, which act on top of the scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from robsim.base.errors import InputError, format_value
from robsim.ros2.middleware import load_message_type
from robsim.run.ros_connection import RosConnection
from robsim.world.scene import Scene

DESCRIPTOR = "rcl_interfaces/msg/ParameterDescriptor"
TEXT_TABLES, LIST_TABLES = ("names", "frames"), ("ids",)


def declare_connection(node: Any, connection: RosConnection, scene: Scene) -> RosConnection:
    """Declare the fields of a connection as parameters of a node, and return the connection.

    Raises
    ------
    InputError
        If the value of a parameter is not valid, or does not fit the scene.
    """
    any_type = load_message_type(DESCRIPTOR)(dynamic_typing=True, read_only=True)

    def read(name: str, default: object) -> Any:
        return node.declare_parameter(name, default, any_type).value

    changed = change_connection(connection, read)
    changed.check(scene)
    return changed


def change_connection(
    connection: RosConnection, read: Callable[[str, object], object]
) -> RosConnection:
    """Return a connection with the fields that `read(name, default)` returns.

    Tables are lists of "KEY=VALUE", and ids are separated by commas. A list without entries has one
    empty text, because parameters of ROS have no type for an empty list.

    >>> told = {"names": ["elbow=joint_3"], "ids": ["plate=a,b"], "timeout": 1}
    >>> changed = change_connection(RosConnection(), lambda name, default: told.get(name, default))
    >>> dict(changed.names), dict(changed.ids), changed.timeout, changed.joints
    ({'elbow': 'joint_3'}, {'plate': ('a', 'b')}, 1.0, '/joint_states')
    """
    values: dict[str, Any] = {}
    for name in (each.name for each in fields(connection)):
        value = read(name, _to_parameter(getattr(connection, name)))
        values[name] = _from_parameter(name, value)
    return RosConnection(**values)


def _to_parameter(value: Any) -> object:
    """Return a field of a connection as a text, a number or a list of texts."""
    if isinstance(value, str | float):
        return value
    if not _is_table(value):
        return list(value) or [""]
    pairs = dict(value).items()
    return [f"{key}={of if isinstance(of, str) else ','.join(of)}" for key, of in pairs] or [""]


def _is_table(value: Any) -> bool:
    """Return whether a field is a table {key: value}, as a mapping or as pairs."""
    if isinstance(value, Mapping):
        return True
    return bool(value) and all(isinstance(each, tuple) for each in value)


def _from_parameter(name: str, value: object) -> object:
    """Return the field of a connection that a parameter contains."""
    if not isinstance(value, list | tuple):
        return value
    texts = [text for text in value if text]
    if name not in (*TEXT_TABLES, *LIST_TABLES):
        return tuple(texts)
    for text in texts:
        if not isinstance(text, str) or "=" not in text:
            raise InputError(f"{name}: expected KEY=VALUE, got {format_value(text)}")
    pairs = (text.split("=", 1) for text in texts)
    return {key: each.split(",") if name in LIST_TABLES else each for key, each in pairs}
