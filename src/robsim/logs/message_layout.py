"""The places of times and numbers in messages that differ in nothing else."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from itertools import count
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.logs import message_types
from robsim.run.log import NANO, Times

_ONES = 0x01010101  # no byte of this number is zero
_OTHER = float(np.full(8, 1, np.uint8).view(np.float64)[0])  # nor of this one
_STAMP = "builtin_interfaces/msg/Time"
_UNREAD = {  # fields of numbers that are not read, by the type of the message
    "vision_msgs/msg/Detection2D": ("header",),
    "vision_msgs/msg/ObjectHypothesis": ("score",),
    "vision_msgs/msg/ObjectHypothesisWithPose": ("pose",),
    "vision_msgs/msg/BoundingBox2D": ("size_x", "size_y"),
    "vision_msgs/msg/Pose2D": ("theta",),
    "sensor_msgs/msg/CameraInfo": ("d", "r", "p"),
}
Build = Callable[[Sequence[Any]], Any]  # of the parts of a message


class MessageLayout:
    """The layout of messages in CDR that differ from an example in stamps and numbers only.

    The example is serialised by rosbags with other stamps, and with other float64 numbers: where
    its bytes differ, a stamp or a number is stored.

    Parameters
    ----------
    kind : str
        Type of the messages.
    example : object
        Message of rosbags with the strings and the lengths of all messages.
    """

    def __init__(self, kind: str, example: message_types.Message) -> None:
        plain = _fill(example, 0, 0.0)
        self.kind, self._plain = kind, _serialize(kind, plain)
        self._stamps = np.flatnonzero(_serialize(kind, _fill(plain, _ONES, 0.0)) != self._plain)
        numbers = _serialize(kind, _fill(plain, 0, _OTHER)) != self._plain
        self._numbers = np.flatnonzero(numbers)
        is_read = _serialize(kind, _fill(plain, _ONES, _OTHER, unread=False)) != self._plain
        self._parts, fixed = self._find_parts(is_read)
        self._get_fixed = itemgetter(*fixed)
        self._fixed = self._get_fixed(self._parts.unpack(self._plain.tobytes()))
        self._example = _drop_unread(example)
        places = iter(i for i in count() if i not in fixed)
        self._build = _make_builder(self._example, places)

    def serialize(self, times: Times, numbers: Array) -> list[bytes]:
        """Return the messages of times (T,) in nanoseconds and of all their numbers (T, N)."""
        rows = np.tile(self._plain, (len(times), 1))
        stamps = np.stack([times // NANO, times % NANO], axis=1).astype("<u4").view(np.uint8)
        rows[:, self._stamps] = np.tile(stamps, (1, len(self._stamps) // 8))
        doubles = np.ascontiguousarray(numbers, dtype="<f8").reshape(len(times), -1)
        rows[:, self._numbers] = doubles.view(np.uint8)
        return [row.tobytes() for row in rows]

    def parse(self, data: bytes) -> message_types.Message | None:
        """Return the message, or None if it differs from the example in other parts.

        Fields of numbers that are not read are None.
        """
        if len(data) != self._parts.size:
            return None
        parts = self._parts.unpack(data)
        if self._get_fixed(parts) != self._fixed:
            return None
        return self._build(parts) if self._build else self._example

    def _find_parts(self, is_read: NDArray[np.bool_]) -> tuple[struct.Struct, list[int]]:
        """Return the parts of a message, and the numbers of those that all messages share."""
        kinds = np.zeros(len(self._plain), np.int8)
        kinds[self._stamps], kinds[self._numbers] = 1, 2
        kinds[(kinds > 0) & ~is_read] = 3
        text, fixed, at, number = "<", list[int](), 0, 0
        while at < len(kinds):
            form, size, width = "", int(np.argmax(np.append(kinds[at:], -1) != kinds[at])), 1
            if kinds[at] == 0:
                form = f"{size}s"
                fixed.append(number)
            elif kinds[at] == 1:
                form, size, width = "iI", 8, 2
            elif kinds[at] == 2:
                form, size = "d", 8
            else:
                form, width = f"{size}x", 0
            text, at, number = text + form, at + size, number + width
        return struct.Struct(text), fixed


class LearnedLayout:
    """The layout of one of the last messages of a topic, to parse those that are alike.

    It takes as long to find a layout as to read tens of messages. It is found again after twice as
    many other messages each time, so messages that always differ cost no more than by rosbags.
    """

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._layout: MessageLayout | None = None
        self._others, self._patience = 0, 1

    def parse(self, data: bytes) -> message_types.Message | None:
        """Return the message, or None if it has another layout."""
        return self._layout.parse(data) if self._layout else None

    def learn(self, message: message_types.Message) -> None:
        """Take a message with another layout into account."""
        self._others += 1
        if self._others == self._patience:
            self._layout = MessageLayout(self._kind, message)
            self._others, self._patience = 0, 2 * self._patience


def _serialize(kind: str, message: message_types.Message) -> NDArray[np.uint8]:
    """Return the bytes of a message in CDR."""
    return np.frombuffer(message_types.serialize_message(kind, message), np.uint8)


def _fill(value: Any, stamp: int, number: float, unread: bool = True) -> Any:
    """Return a part of a message with all seconds and nanoseconds, and all numbers, replaced.

    `unread` also replaces the fields that are not read.
    """
    if isinstance(value, float):
        return number
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return np.full_like(value, number)
    if isinstance(value, list):
        return [_fill(each, stamp, number, unread) for each in value]
    if not is_dataclass(value) or isinstance(value, type):
        return value
    if _is_stamp(value):
        return replace(value, sec=stamp, nanosec=stamp)
    kept = () if unread else _list_unread(value)
    names = [name for name in _list_field_names(value) if name not in kept]
    return replace(value, **{k: _fill(getattr(value, k), stamp, number, unread) for k in names})


def _drop_unread(value: Any) -> Any:
    """Return a part of a message with None as each field that is not read."""
    if isinstance(value, list):
        return [_drop_unread(each) for each in value]
    if not is_dataclass(value) or isinstance(value, type):
        return value
    read = set(_list_field_names(value)) - set(_list_unread(value))
    changes: dict[str, Any] = dict.fromkeys(_list_unread(value))
    return replace(value, **changes | {k: _drop_unread(getattr(value, k)) for k in read})


def _make_builder(example: Any, places: Iterator[int]) -> Build | None:
    """Return the function that builds a message like an example from the parts at places.

    It is compiled from one expression, as rosbags does it, because nested functions would take
    twice the time. The result is None if all messages are equal.
    """
    objects: dict[str, Any] = {"array": np.array}
    text = _write_expression(example, places, objects)
    build: Build | None = eval(f"lambda parts: {text}", objects) if text else None
    return build


def _write_expression(value: Any, places: Iterator[int], objects: dict[str, Any]) -> str | None:
    """Return the expression of a part of a message like `value`, and name its objects.

    The result is None for a part that all messages share.
    """
    if isinstance(value, float):
        return f"parts[{next(places)}]"
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and len(value):
        numbers = [next(places) for _ in value]
        return f"array(parts[{numbers[0]}:{numbers[-1] + 1}])"
    if isinstance(value, list):
        items = [_write_expression(item, places, objects) for item in value]
        return f"[{_join_expressions(value, items, objects)}]" if any(items) else None
    if not is_dataclass(value) or isinstance(value, type):
        return None
    contents = [getattr(value, name) for name in _list_field_names(value)]
    if _is_stamp(value):
        items = [f"parts[{next(places)}]" for _ in contents]
    else:
        items = [_write_expression(each, places, objects) for each in contents]
    if not any(items):
        return None
    return f"{_name(type(value), objects)}({_join_expressions(contents, items, objects)})"


def _join_expressions(
    values: Sequence[Any], items: Sequence[str | None], objects: dict[str, Any]
) -> str:
    """Return the expressions of values, separated by commas; shared values are named."""
    pairs = zip(values, items, strict=True)
    return ", ".join(text or _name(value, objects) for value, text in pairs)


def _name(value: Any, objects: dict[str, Any]) -> str:
    """Return a new name of an object, and store the object under it."""
    objects[name := f"object{len(objects)}"] = value
    return name


def _list_field_names(value: Any) -> list[str]:
    """Return the names of the fields of a message, without the name of its type."""
    return [field.name for field in fields(value) if field.name != "__msgtype__"]


def _list_unread(value: Any) -> Sequence[str]:
    """Return the names of the fields of a message that are not read."""
    return _UNREAD.get(_get_type(value), ())


def _is_stamp(value: Any) -> bool:
    return _get_type(value) == _STAMP


def _get_type(value: Any) -> str:
    """Return the type of a message."""
    return str(getattr(value, "__msgtype__", ""))
