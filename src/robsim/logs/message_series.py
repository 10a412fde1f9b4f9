"""Many messages of one kind in CDR, which differ in their times and numbers only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.logs import message_types
from robsim.run.log import NANO, Times

_ONES = 0x01010101  # no byte of this number is zero
_OTHER_TIME = _ONES * NANO + _ONES
_OTHER_NUMBER = float(np.full(8, 1, np.uint8).view(np.float64)[0])  # nor of this one
MessageMaker = Callable[[int, Array], message_types.Message]  # of a time in ns and numbers


class MessageSeries:
    """Messages of one kind that differ in the stamps of their headers and in float64 numbers.

    The message with all times and numbers zero is serialised once by rosbags. Other messages have
    other bytes where a time or a number is written.

    Parameters
    ----------
    kind : str
        Type of the messages.
    make : callable
        Function that returns the message of a time in nanoseconds and numbers (width,), in the
        order in which the message stores them.
    width : int
        Number of the numbers.
    """

    def __init__(self, kind: str, make: MessageMaker, width: int) -> None:
        zero = np.zeros(width)
        self.kind, self._plain = kind, _serialize(kind, make(0, zero))
        timed = _serialize(kind, make(_OTHER_TIME, zero))
        self._stamps = np.flatnonzero(timed != self._plain)
        other = _serialize(kind, make(0, np.full(width, _OTHER_NUMBER)))
        self._numbers = np.flatnonzero(other != self._plain)

    def serialize(self, times: Times, numbers: Array) -> list[bytes]:
        """Return the messages of times (T,) in nanoseconds and numbers (T, width)."""
        count = len(times)
        rows = np.tile(self._plain, (count, 1))
        stamps = np.stack([times // NANO, times % NANO], axis=1).astype("<u4").view(np.uint8)
        rows[:, self._stamps] = np.tile(stamps, (1, len(self._stamps) // 8))
        doubles = np.ascontiguousarray(numbers, dtype="<f8").reshape(count, -1)
        rows[:, self._numbers] = doubles.view(np.uint8)
        return [row.tobytes() for row in rows]


def _serialize(kind: str, message: message_types.Message) -> NDArray[np.uint8]:
    """Return the bytes of a message in CDR, little-endian."""
    store = message_types.load_typestore()
    return np.frombuffer(store.serialize_cdr(message, kind, little_endian=True), np.uint8)
