"""Marks as std_msgs/Float64MultiArray, for systems without vision_msgs.

The label of dimension i is the id of mark i. The data are the seconds and nanoseconds at which the
image was taken, and then the column and the row of each mark in pixels.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.logs.command_messages import MakeMessage
from robsim.logs.message_types import NUMBERS, STAMP, Message
from robsim.run.log import NANO


def make_mark_array(make: MakeMessage, time: int, ids: Sequence[str], pixels: Array) -> Message:
    """Return the message of marks at pixels (N, 2) in an image that was taken at a time in ns."""
    size = pixels.size
    dim = [
        make("std_msgs/msg/MultiArrayDimension", label=name, size=2, stride=size) for name in ids
    ]
    layout = make("std_msgs/msg/MultiArrayLayout", dim=dim, data_offset=STAMP)
    data = np.concatenate([[time // NANO, time % NANO], pixels.ravel()])
    return make(NUMBERS, layout=layout, data=data)


def list_marks(message: Message) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the id and the pixel of each mark; InputError if their numbers differ."""
    pixels = np.asarray(message.data[STAMP:], dtype=np.float64)
    if pixels.size != 2 * len(message.layout.dim):
        raise InputError(
            f"an array of {len(message.layout.dim)} marks has {pixels.size} numbers of pixels"
        )
    for each, (column, row) in zip(message.layout.dim, pixels.reshape(-1, 2).tolist(), strict=True):
        yield each.label, (column, row)
