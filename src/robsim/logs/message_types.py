"""The types of the ROS 2 messages in bags.

Marks are written as `vision_msgs/Detection2DArray`, a standard type with the names of marks and
pixels in float64. (A PointCloud has float32 pixels and no names.) AprilTag detections can be read,
too. The definitions in a bag are not parsed: they must agree with the definitions of this module.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from robsim.base.errors import FileError, InputError
from robsim.run.log import NANO

JOINTS = "sensor_msgs/msg/JointState"
NUMBERS = "std_msgs/msg/Float64MultiArray"
TEXT = "std_msgs/msg/String"
LENS = "sensor_msgs/msg/CameraInfo"
DETECTIONS = "vision_msgs/msg/Detection2DArray"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
TWISTS = TWIST, STAMPED
APRILTAGS = "apriltag_msgs/msg/AprilTagDetectionArray"
FRAMES = "tf2_msgs/msg/TFMessage"
IMAGE = "sensor_msgs/msg/Image"
ODOMETRY, POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
Message = Any  # Any: rosbags and rclpy create the classes of messages at run time
STAMP = 2  # numbers of the time at the start of an array of marks, its data_offset
LATEST = 2**31  # seconds: upper limit of a stamp
LONGEST = 1 << 26  # items of a sequence, such as the bytes of an image
# fields of vision_msgs 4 and apriltag_msgs 2, which are not part of ROS itself
_VISION = {
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose",
    "vision_msgs/msg/Detection2D": "std_msgs/Header header\n"
    "vision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox2D bbox\n"
    "string id",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\n"
    "vision_msgs/Detection2D[] detections",
    "apriltag_msgs/msg/Point": "float64 x\nfloat64 y",
    "apriltag_msgs/msg/AprilTagDetection": "string family\nint32 id\nint32 hamming\n"
    "float32 goodness\nfloat32 decision_margin\napriltag_msgs/Point centre\n"
    "apriltag_msgs/Point[4] corners\nfloat64[9] homography",
    "apriltag_msgs/msg/AprilTagDetectionArray": "std_msgs/Header header\n"
    "apriltag_msgs/AprilTagDetection[] detections",
}


@cache
def load_typestore() -> Any:
    """Return the store of known message types; raise InputError if rosbags is not installed."""
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise InputError("a bag needs rosbags: pip install 'robsim[ros]'") from None
    store: Any = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in _VISION.items():
        store.register(get_types_from_msg(text, name))
    store.max_sequence_length = LONGEST
    return store


def make_message(kind: str, **fields: Any) -> Message:
    """Return a message of a type, such as `JOINTS`."""
    return load_typestore().types[kind](**fields)


def serialize_message(kind: str, message: Message) -> bytes:
    """Return a message in CDR, little-endian."""
    return bytes(load_typestore().serialize_cdr(message, kind, little_endian=True))


def header_time(message: object) -> int | None:
    """Return the time in nanoseconds in the header of a message, or None without a header.

    An array of marks begins with its time.
    """
    header = getattr(message, "header", None)
    if header is not None:
        return int(header.stamp.sec) * NANO + int(header.stamp.nanosec)
    return read_stamp(message) if is_mark_array(message) else None


def is_mark_array(message: Message) -> bool:
    """Return whether a message is an array of marks, and not of commands."""
    layout = getattr(message, "layout", None)
    return layout is not None and layout.data_offset == STAMP


def read_stamp(message: Message) -> int:
    """Return the time in nanoseconds at which the image was taken; InputError if it is none."""
    stamp = [float(x) for x in message.data[:STAMP]]
    whole = len(stamp) == STAMP and all(x.is_integer() and x >= 0.0 for x in stamp)
    if not whole or stamp[0] >= LATEST or stamp[1] >= NANO:
        raise InputError(f"an array of marks begins with seconds and nanoseconds, got {stamp}")
    return int(stamp[0]) * NANO + int(stamp[1])


def check_message_definition(kind: str, definition: str, what: str) -> None:
    """Raise FileError if a bag defines a message type with other fields."""
    ours, _ = load_typestore().generate_msgdef(kind, ros_version=2)
    if definition and _definition_fields(definition) != _definition_fields(ours):
        raise FileError(
            f"{what}: {kind} has other fields in this bag than in ROS 2 Humble, vision_msgs 4 or "
            "apriltag_msgs 2, which are supported"
        )


def _definition_fields(definition: str) -> list[list[str]]:
    """Return [type, name] of each field of a definition, without the fields of nested types."""
    outer = definition.split("=" * 80, maxsplit=1)[0]
    lines = (line.split("#", maxsplit=1)[0].split() for line in outer.splitlines())
    fields = [line[:2] for line in lines if len(line) > 1 and "=" not in "".join(line)]
    return [[kind.rsplit("/", maxsplit=1)[-1], name] for kind, name in fields]
