"""Messages and bags of ROS 2, as the tests of peers make and read them by rosbags."""

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

import robsim as rs
from robsim.logs import message_types
from robsim.logs.command_messages import make_header, make_joint_state
from robsim.logs.message_types import make_message

NANO = 1_000_000_000


def transform(parent, child, pose, t=0.0):
    """A TransformStamped of a pose (7,): position, and quaternion x, y, z, w."""
    x, y, z, *rotation = (float(value) for value in pose)
    move = make_message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
    turn = make_message("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", rotation, strict=True)))
    return make_message(
        "geometry_msgs/msg/TransformStamped",
        header=make_header(make_message, round(t * NANO), parent),
        child_frame_id=child,
        transform=make_message("geometry_msgs/msg/Transform", translation=move, rotation=turn),
    )


def serialise(each):
    """A message as it comes out of its bytes."""
    store = message_types.load_typestore()
    return store.deserialize_cdr(store.serialize_cdr(each, each.__msgtype__), each.__msgtype__)


def state(q, names, t=0.0):
    return serialise(
        make_joint_state(make_message, round(t * NANO), names, np.array(q, float), np.empty(0))
    )


def detections(marks, t=0.0):
    """A Detection2DArray of {name: (column, row)}."""
    head, found = make_header(make_message, round(t * NANO)), []
    for name, (column, row) in marks.items():
        point = make_message("vision_msgs/msg/Point2D", x=float(column), y=float(row))
        centre = make_message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
        box = make_message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
        kind = "vision_msgs/msg/Detection2D"
        found.append(make_message(kind, header=head, results=[], bbox=box, id=name))
    return serialise(make_message(message_types.DETECTIONS, header=head, detections=found))


def april_tag(family, number, corners):
    """A detection as apriltag_ros has it: corners from the lower left, an edge at a whole pixel."""
    points = [make_message("apriltag_msgs/msg/Point", x=float(x), y=float(y)) for x, y in corners]
    return make_message(
        "apriltag_msgs/msg/AprilTagDetection",
        family=family,
        id=number,
        hamming=0,
        goodness=0.0,
        decision_margin=50.0,
        centre=points[0],
        corners=points,
        homography=np.eye(3).ravel(),
    )


def frames(*each, t=0.0):
    """A TFMessage of (parent, frame, pose)."""
    found = [transform(parent, frame, pose.q, t) for parent, frame, pose in each]
    return serialise(make_message(message_types.FRAMES, transforms=found))


def read_messages(path):
    """The messages of a bag: (topic, type, time, message)."""
    store = message_types.load_typestore()
    with AnyReader([path]) as reader:
        for c, t, data in reader.messages():
            yield c.topic, c.msgtype, t, store.deserialize_cdr(data, c.msgtype)


def write_bag(path, content, storage=StoragePlugin.MCAP, packed=CompressionMode.NONE):
    """Write a bag of some messages: (topic, type, time, message)."""
    store = message_types.load_typestore()
    writer = Writer(path, version=8, storage_plugin=storage)
    if packed is not CompressionMode.NONE:
        writer.set_compression(packed, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, time, each in content:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time, store.serialize_cdr(each, kind))
    return path


def change_topic(content, of, change):
    """Yield the messages, those on one topic changed by `change`: (topic, kind, time, message)."""
    count = -1
    for topic, kind, time, each in content:
        if topic != of:
            yield topic, kind, time, each
            continue
        count += 1
        yield topic, kind, *change(count, time, each)


def remake(each, **fields):
    """Return the message with some fields replaced."""
    names = [name for name, _ in message_types.load_typestore().fielddefs[each.__msgtype__][1]]
    return make_message(each.__msgtype__, **{name: getattr(each, name) for name in names} | fields)


def later(each, seconds):
    """A message with a later stamp, or an earlier one, down to 0."""
    old = each.header
    time = old.stamp.sec * NANO + old.stamp.nanosec + int(seconds * NANO)
    return remake(each, header=make_header(make_message, max(time, 0), old.frame_id))


def check_refusal(path, words, experiment=None, **how):
    """See that a bag is refused in one line that names it once."""
    with pytest.raises(rs.errors.FileError, match=words) as raised:
        rs.logs.read_bag(path, experiment, **how)
    assert "\n" not in str(raised.value) and str(raised.value).count(str(path)) == 1
