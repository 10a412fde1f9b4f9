"""Messages that differ in times and numbers are written and read as rosbags does it."""

import numpy as np
import pytest

pytest.importorskip("rosbags")

from robsim.logs import message_layout, message_types
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
    kind = message_types.JOINTS
    layout = MessageLayout(kind, state(1, np.zeros(6)))
    data = serialize(kind, state(5_000_000_001, np.array([1.0, np.nan, -0.0, 7.5, 1e300, 0.1])))
    message = layout.parse(data)
    assert serialize(kind, message) == data
    assert message_types.header_time(message) == 5_000_000_001


def hypothesis(score, covariance):
    make = make_message
    guess = make("vision_msgs/msg/ObjectHypothesis", class_id="plate", score=score)
    place = make("geometry_msgs/msg/Point", x=score, y=0.0, z=0.0)
    turn = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    pose = make(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=make("geometry_msgs/msg/Pose", position=place, orientation=turn),
        covariance=np.full(36, covariance),
    )
    return make("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis=guess, pose=pose)


def test_parsed_detections_have_the_numbers_that_are_read_and_no_others():
    kind = message_types.DETECTIONS
    examples = [
        detections(1, [1.0, 2.0, 3.0, 4.0]),
        detections(5_000_000_001, [10.5, 20.25, -3.0, 0.125]),
    ]
    for i, each in enumerate(examples):
        each.detections[1].results.append(hypothesis(0.5 + i, 7.0 * i))
    layout = MessageLayout(kind, examples[0])
    message = layout.parse(serialize(kind, examples[1]))
    assert message_types.header_time(message) == 5_000_000_001
    boxes = [each.bbox.center for each in message.detections]
    assert [(box.position.x, box.position.y) for box in boxes] == [(10.5, 20.25), (-3.0, 0.125)]
    assert [each.id for each in message.detections] == ["plate.0", "plate.1"]
    last = message.detections[1]
    assert last.results[0].hypothesis.class_id == "plate"
    assert last.header is last.results[0].pose is last.results[0].hypothesis.score is None
    assert boxes[1].theta is last.bbox.size_x is None


def test_parsed_intrinsics_are_those_of_the_message():
    kind = message_types.LENS
    fields = dict(height=480, width=640, distortion_model="plumb_bob", binning_x=0, binning_y=0)
    roi = make_message(
        "sensor_msgs/msg/RegionOfInterest",
        **dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0),
        do_rectify=False,
    )

    def lens(time, k):
        header = make_header(make_message, time, "camera")
        parts = {"d": np.zeros(5), "r": np.zeros(9), "p": np.zeros(12), "k": k, "roi": roi}
        return make_message(kind, header=header, **fields, **parts)

    message = MessageLayout(kind, lens(1, np.ones(9))).parse(
        serialize(kind, lens(2, np.arange(9.0)))
    )
    assert message.k.tolist() == list(range(9)) and message.width == 640
    assert message.d is message.r is message.p is None


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


def test_messages_that_always_differ_have_few_layouts(monkeypatch):
    made = []

    class Counted(MessageLayout):
        def __init__(self, kind, example):
            made.append(example)
            super().__init__(kind, example)

    monkeypatch.setattr(message_layout, "MessageLayout", Counted)
    kind, learned = message_types.DETECTIONS, message_layout.LearnedLayout(message_types.DETECTIONS)
    parsed = 0
    for i in range(100):
        count = 1 + i % 3
        numbers = np.arange(2.0 * count) + i
        sent = detections(i, numbers, [f"plate.{j}" for j in range(count)])
        message = learned.parse(serialize(kind, sent))
        if message is None:
            learned.learn(sent)
        else:
            parsed += 1
            found = [each.bbox.center.position for each in message.detections]
            assert [x for each in found for x in (each.x, each.y)] == numbers.tolist()
    assert len(made) <= 7 and parsed >= 25
