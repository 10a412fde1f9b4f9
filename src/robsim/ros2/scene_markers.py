"""Markers of the solids of a scene, for RViz."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.logs.command_messages import make_header
from robsim.logs.scene_messages import make_pose
from robsim.plot.wireframe import ScenePart, list_scene_parts
from robsim.robot.urdf.shape_export import color_to_rgba
from robsim.ros2.middleware import make_ros_message
from robsim.run.log import NANO
from robsim.world.scene import Scene

MARKER = "visualization_msgs/msg/Marker"
FRUSTUM_DEPTH = 0.1  # metres, of cameras without a housing
LINE_WIDTH = 0.004  # metres
PLACEHOLDER = 987_654_321  # seconds and nanoseconds of a marker that is not placed


class SceneMarkers:
    """The markers of all solids of a scene, which are serialised once and placed at each message.

    Triangles and colours stay; only the times and the poses in the serialised message change. To
    serialise the triangles each time would take milliseconds.

    Parameters
    ----------
    scene : Scene
        Scene with the solids.
    root : str
        Frame of the poses.
    """

    def __init__(self, scene: Scene, root: str) -> None:
        from rclpy.serialization import serialize_message

        parts = [part for part in list_scene_parts(scene, FRUSTUM_DEPTH) if not part.to]
        self._frames = [part.frame for part in parts]
        markers = [_make_marker(number, part) for number, part in enumerate(parts)]
        for number, marker in enumerate(markers):
            marker.header = make_header(make_ros_message, _placeholder_time(number), root)
            marker.pose = make_pose(make_ros_message, _placeholder_pose(number))
        message = make_ros_message("visualization_msgs/msg/MarkerArray", markers=markers)
        self._bytes = bytearray(serialize_message(message))
        numbers = range(len(markers))
        times = (_pack_time(_placeholder_time(number)) for number in numbers)
        self._times = [self._bytes.index(each) for each in times]
        self._poses = [self._bytes.index(_placeholder_pose(number).tobytes()) for number in numbers]

    def place(self, poses: dict[str, Array], time: int) -> bytes:
        """Return the serialised MarkerArray at a time in ns, at poses (7,) of all frames."""
        stamp = _pack_time(time)
        for frame, at, pose in zip(self._frames, self._times, self._poses, strict=True):
            self._bytes[at : at + len(stamp)] = stamp
            values = np.asarray(poses[frame], dtype=np.float64).tobytes()
            self._bytes[pose : pose + len(values)] = values
        return bytes(self._bytes)


def _placeholder_time(number: int) -> int:
    """Return the time in ns of a marker until it is placed, which no other content contains."""
    return (PLACEHOLDER + number) * NANO + PLACEHOLDER


def _placeholder_pose(number: int) -> Array:
    """Return the pose (7,) of a marker until it is placed, which no other content contains."""
    return np.full(7, -1e200 * (number + 1))


def _pack_time(time: int) -> bytes:
    """Return the seconds and nanoseconds of a time as in a serialised message."""
    return struct.pack("=iI", *divmod(time, NANO))


def _make_marker(number: int, part: ScenePart) -> Any:
    """Return the marker of a solid in the axes of its frame: triangles, or lines without faces."""
    wire = part.wire
    red, green, blue, _ = color_to_rgba(wire.color)
    color = make_ros_message("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0)
    triangles = [_split_polygon(np.asarray(face)) for face in wire.faces]
    points = np.concatenate(triangles) if triangles else wire.segments.reshape(-1, 3)
    size = 1.0 if triangles else LINE_WIDTH
    scale = make_ros_message("geometry_msgs/msg/Vector3", x=size, y=size, z=size)
    kind = "TRIANGLE_LIST" if triangles else "LINE_LIST"
    marker = make_ros_message(MARKER, ns=part.frame, id=number, scale=scale, color=color)
    marker.type = getattr(type(marker), kind)
    names = ("x", "y", "z")
    marker.points = [
        make_ros_message("geometry_msgs/msg/Point", **dict(zip(names, point, strict=True)))
        for point in points.tolist()
    ]
    return marker


def _split_polygon(face: Array) -> Array:
    """Return the corners (3 (n - 2), 3) of the triangles of a convex polygon (n, 3)."""
    pairs = [face[[0, i, i + 1]] for i in range(1, len(face) - 1)]
    return np.concatenate(pairs) if pairs else np.empty((0, 3))
