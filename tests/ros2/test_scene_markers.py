"""Markers of the solids of a scene, serialised once and placed at each message."""

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import MarkerArray

import robsim as rs
from robsim.logs.scene_messages import compute_frame_poses
from robsim.ros2.scene_markers import SceneMarkers


def read_pose(marker):
    place, turn = marker.pose.position, marker.pose.orientation
    return [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def read_points(message):
    return [[(p.x, p.y, p.z) for p in marker.points] for marker in message.markers]


@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand", "unicycle_docking"])
def test_each_marker_has_the_time_and_the_pose_of_its_frame(name):
    scene = rs.load_scenario(rs.examples.path(name)).scene
    markers, read = SceneMarkers(scene, "map"), []
    for step, q in enumerate([scene.home, scene.home + 0.1]):
        poses = {key: T[0] for key, T in compute_frame_poses(scene, q[None]).items()}
        read.append(
            deserialize_message(markers.place(poses, (7 + step) * 10**9 + 250), MarkerArray)
        )
        assert len(read[-1].markers) > 1
        for number, marker in enumerate(read[-1].markers):
            np.testing.assert_array_equal(read_pose(marker), poses[marker.ns])
            stamp = marker.header.stamp
            assert (stamp.sec, stamp.nanosec, marker.header.frame_id) == (7 + step, 250, "map")
            assert marker.id == number and len(marker.points) > 1 and marker.color.a == 1.0
    assert read_points(read[0]) == read_points(read[1])
