"""Messages that differ in times and numbers are written and read as rosbags does it."""

import numpy as np
import pytest

pytest.importorskip("rosbags")

from robsim.logs import message_types
from robsim.logs.command_messages import make_header, make_joint_state
from robsim.logs.message_layout import MessageLayout
from robsim.logs.message_types import make_message
from robsim.logs.scene_messages import make_detections

NAMES = ["shoulder", "elbow", "q"]


def state(time, numbers):
    return make_joint_state(make_message, time, NAMES, numbers[:3], numbers[3:])


def detections(time, numbers, ids=("plate.0", "plate.1")):
    header = make_header(make_message, time, "camera")
    return make_detections(make_message, header, ids, np.reshape(numbers, (-1, 2)))


def serialize(kind, message):
    return bytes(message_types.load_typestore().serialize_cdr(message, kind))


def test_bytes_agree_with_rosbags():
    numbers = np.array([[1.0, -2.5, np.nan, 1e300, 0.0, 7.0], [0.1, 0.2, 0.3, -0.0, np.inf, 5.0]])
    times = np.array([3_000_000_007, 12])
    layout = MessageLayout(message_types.JOINTS, state(0, np.zeros(6)))
    pairs = zip(times.tolist(), numbers, strict=True)
    expected = [serialize(message_types.JOINTS, state(*pair)) for pair in pairs]
    assert layout.serialize(times, numbers) == expected


def test_a_parsed_message_has_the_bytes_it_was_read_from():
    kind = message_types.DETECTIONS
    layout = MessageLayout(kind, detections(1, [1.0, 2.0, 3.0, 4.0]))
    data = serialize(kind, detections(5_000_000_001, [10.5, 20.25, -3.0, 0.125]))
    message = layout.parse(data)
    assert serialize(kind, message) == data
    assert message_types.header_time(message) == 5_000_000_001
    assert message.detections[1].bbox.center.position.x == -3.0


def test_other_strings_and_lengths_are_not_parsed():
    kind = message_types.DETECTIONS
    layout = MessageLayout(kind, detections(1, [1.0, 2.0, 3.0, 4.0]))
    other = detections(1, [1.0, 2.0, 3.0, 4.0], ("plate.0", "plate.2"))
    assert layout.parse(serialize(kind, other)) is None
    assert layout.parse(serialize(kind, detections(1, [1.0, 2.0], ("plate.0",)))) is None
    big_endian = message_types.load_typestore().serialize_cdr(
        detections(1, [1.0, 2.0, 3.0, 4.0]), kind, little_endian=False
    )
    assert layout.parse(bytes(big_endian)) is None
