"""Every plain URDF of two packages of robots: read, or refused with a reason; and its poses."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

TOLERANCE = 1e-10
REFUSED = {
    # it is no XML
    "rtbdata/test": ":1: not valid XML: syntax error",
    # a robot without a name and without links
    "ur_description/ur3": "<robot>: 0 links; from 1 to 2048 are allowed",
    # meshes at an absolute place of somebody's disk
    "romeo_description/romeo_laas_small": "mesh 'file:///usr/Romeo/naoqi-sdk",
    # joints that mimic a joint which does not exist
    "alex_description/alex_psyonic_hands": "<joint 'Left_index_q2'>: mimic: no joint 'index_q1'",
}
# where a joint mimics one that comes later in the tree, which Pinocchio does not read
MIMICS_LATER = ("romeo", "talos_full_v2", "talos_full_v2_box")
THOROUGHLY = ("panda", "ur5_robot", "lbr_iiwa_14_r820")


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.FileWarning)
        return rs.Robot.from_urdf(path)


@pytest.fixture
def name(published, request):
    return request.node.callspec.id


def test_it_is_read_and_has_the_poses_of_pinocchio_or_it_is_refused(
    published, name, pinocchio_reads, some_coordinates
):
    if name in REFUSED:
        with pytest.raises(rs.FileError) as caught:
            read(published)
        assert REFUSED[name] in str(caught.value)
        return
    robot = read(published)
    mimic = Path(published).stem not in MIMICS_LATER
    peer = pinocchio_reads(published, robot, mimic)
    frames = peer.frames()
    assert set(frames) == {link.name for link in robot.links}
    every = Path(published).stem in THOROUGHLY
    for q in some_coordinates(robot, 3 if every else 1):
        peer.at(q)
        poses = robot.frames(q)
        for pose, link in zip(poses, robot.links, strict=True):
            np.testing.assert_allclose(pose, peer.pose(frames[link.name]), rtol=0, atol=TOLERANCE)
            if mimic and (every or link.name == robot.tip):
                ours, theirs = robot.jacobian(q, link.name), peer.jacobian(frames[link.name])
                np.testing.assert_allclose(ours, theirs, rtol=0, atol=TOLERANCE)


def test_it_comes_back_from_a_file_of_ours(published, name, tmp_path, some_coordinates):
    if name in REFUSED:
        return
    robot = read(published)
    robot.to_urdf(tmp_path / "robot.urdf")
    back = rs.Robot.from_urdf(tmp_path / "robot.urdf")
    assert [k.name for k in back.links] == [k.name for k in robot.links]
    assert back.coordinate_names == robot.coordinate_names
    assert [k.inertia for k in back.links] == [k.inertia for k in robot.links]
    np.testing.assert_array_equal(back.limits, robot.limits)
    q = some_coordinates(robot)
    np.testing.assert_allclose(back.frames(q), robot.frames(q), rtol=0, atol=1e-12)
