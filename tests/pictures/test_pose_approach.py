"""Coordinates near others that bring a camera to a pose, for the picture at a goal."""

import numpy as np
import pytest

import robsim as rs
from robsim.world.pose_approach import approach_pose


@pytest.mark.parametrize("name", ["stereo_in_hand", "eye_in_hand", "visp_tutorial", "holonomic"])
def test_a_pose_nearby_is_reached(name):
    scene = rs.load_scenario(rs.examples.path(name)).scene
    eye, rng = scene.cameras[0].name, np.random.default_rng(3)
    rates = 0.3 * rng.standard_normal((scene.nv, 8))
    q = np.repeat(scene.home[:, None], 8, axis=1)
    scene.tree.advance(q, rates, 1.0)
    for column in q.T:
        goal = scene.pose(eye, column)
        found = approach_pose(scene, eye, goal, scene.home)
        away = goal.inv() @ scene.pose(eye, found)
        assert np.abs(away.position).max() < 1e-7 and np.abs(away.rotvec).max() < 1e-7
        assert found.shape == (scene.nq,) and scene.home is not found


def test_a_fixed_body_and_a_pose_out_of_reach_are_not_reached():
    scene = rs.load_scenario(rs.examples.path("stereo_in_hand")).scene
    there = scene.pose("left")
    assert approach_pose(scene, "left", there @ rs.Pose.at(0, 0, -5), scene.home) is None
    assert approach_pose(scene, "plate", there, scene.home) is None
    np.testing.assert_array_equal(approach_pose(scene, "left", there, scene.home), scene.home)


def test_wheels_do_not_slip_to_a_pose():
    scene = rs.load_scenario(rs.examples.path("differential_drive")).scene
    beside = rs.Pose.at(0, 0.2, 0) @ scene.pose("camera")
    assert approach_pose(scene, "camera", beside, scene.home) is None
