"""The connection of an experiment as parameters of a node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from robsim.base.errors import InputError
from robsim.run.ros_connection import RosConnection

Pairs = tuple[tuple[str, Any], ...]  # (name, text) or (name, texts)


def read_parameters(node: Any, connection: RosConnection) -> RosConnection:
    """Declare each field of a connection as a parameter, and return the connection as they set it.

    Tables are lists of "NAME=TEXT", or "NAME=TEXT,TEXT" for ids.

    Raises
    ------
    InputError
        If a parameter is not valid.
    """
    changes: dict[str, Any] = {}
    for each in fields(connection):
        value = getattr(connection, each.name)
        default = write_parameter(each.name, value)
        given = node.declare_parameter(each.name, default).value
        if given != default:
            changes[each.name] = read_parameter(each.name, given)
    return replace(connection, **changes)


def write_parameter(name: str, value: Any) -> Any:
    """Return a field of a connection as the value of a parameter.

    An empty list is [""], as rclpy has no type for an empty list.

    >>> write_parameter("ids", (("plate", ("a", "b")),))
    ['plate=a,b']
    """
    if not isinstance(value, Sequence) or isinstance(value, str):
        return value
    return [_write_pair(each) for each in value] or [""]


def read_parameter(name: str, given: Any) -> Any:
    """Return the field of a connection from the value of a parameter.

    >>> read_parameter("names", ["shoulder=shoulder_pan_joint"])
    {'shoulder': 'shoulder_pan_joint'}
    """
    if name not in ("names", "ids", "frames", "order"):
        return given
    texts = [text for text in given if text]
    if name == "order":
        return tuple(texts)
    if not all("=" in text for text in texts):
        raise InputError(f"parameter {name}: expected texts NAME=TEXT, got {texts}")
    pairs = dict(text.split("=", 1) for text in texts)
    return {key: text.split(",") for key, text in pairs.items()} if name == "ids" else pairs


def _write_pair(value: Any) -> str:
    """Return an entry of a list or of a table as a text."""
    if isinstance(value, str):
        return value
    name, texts = value
    return f"{name}={texts if isinstance(texts, str) else ','.join(texts)}"
