"""Markers of the solids of a scene, for RViz."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.logs.command_messages import make_header
from robsim.logs.scene_messages import make_pose
from robsim.plot.wireframe import ScenePart, list_scene_parts
from robsim.robot.urdf.shape_export import color_to_rgba
from robsim.ros2.middleware import make_ros_message
from robsim.world.scene import Scene

MARKER = "visualization_msgs/msg/Marker"
FRUSTUM_DEPTH = 0.1  # metres, of cameras without a housing
LINE_WIDTH = 0.004  # metres


class SceneMarkers:
    """The markers of all solids of a scene, which are built once and placed at each message."""

    def __init__(self, scene: Scene) -> None:
        self._parts = [part for part in list_scene_parts(scene, FRUSTUM_DEPTH) if not part.to]
        self._markers = [_make_marker(number, part) for number, part in enumerate(self._parts)]

    def place(self, poses: dict[str, Array], time: int, root: str) -> Any:
        """Return the MarkerArray at poses (7,) of all frames in the root frame."""
        header = make_header(make_ros_message, time, root)
        for part, marker in zip(self._parts, self._markers, strict=True):
            marker.header, marker.pose = header, make_pose(make_ros_message, poses[part.frame])
        return make_ros_message("visualization_msgs/msg/MarkerArray", markers=self._markers)


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
