"""Every plain URDF of two packages of robots: read, or refused with a reason; and its poses."""

import warnings
from functools import reduce
from operator import add
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robsim as rs

TOLERANCE = 1e-10
READ = [
    "a1_description/a1",
    "abb_irb140_description/irb140",
    "abb_irb140_description/irb140QT",
    "alex_description/alex_nub_hands",
    "alex_description/alex_sake_hands",
    "alexander_description/alexander_v1.lowerBodyOnly",
    "allegro_hand_description/allegro_left_hand",
    "allegro_hand_description/allegro_right_hand",
    "anymal_b_simple_description/anymal",
    "anymal_b_simple_description/anymal-kinova",
    "anymal_c_simple_description/anymal",
    "asr_twodof_description/TwoDofs",
    "b1_description/b1",
    "b1_description/b1-z1",
    "baxter_description/baxter",
    "bolt_description/bolt",
    "borinot_description/borinot_flying_arm_2",
    "centauro_description/centauro",
    "double_pendulum_description/double_pendulum",
    "double_pendulum_description/double_pendulum_continuous",
    "double_pendulum_description/double_pendulum_simple",
    "finger_edu_description/finger_edu",
    "g1_description/g1_29dof_rev_1_0",
    "g1_description/g1_29dof_with_hand_rev_1_0",
    "go1_description/go1",
    "go2_description/go2",
    "hector_description/quadrotor_base",
    "hextilt_description/hextilt_flying_arm_5",
    "human_description/human",
    "hyq_description/hyq_no_sensors",
    "icub_description/icub",
    "icub_description/icub_reduced",
    "iris_description/iris",
    "iris_description/iris_simple",
    "kinova_description/kinova",
    "kuka_kr120/kr120r2500pro",
    "kuka_kr16/kr16_2",
    "kuka_kr210/kr210l150",
    "kuka_lbr_iiwa/lbr_iiwa_14_r820",
    "laikago_description/laikago",
    "lynxmotion_al5d_description/al5d_robot",
    "panda_description/panda",
    "panda_description/panda_collision",
    "pr2_description/pr2",
    "quadruped_description/quadruped",
    "romeo_description/romeo",
    "romeo_description/romeo_small",
    "simple_humanoid_description/simple_humanoid",
    "simple_humanoid_description/simple_humanoid_classical",
    "so_arm_description/so100",
    "so_arm_description/so101",
    "solo_description/solo",
    "solo_description/solo12",
    "talos_data/talos_full_v2",
    "talos_data/talos_full_v2_box",
    "talos_data/talos_left_arm",
    "talos_data/talos_reduced",
    "talos_data/talos_reduced_box",
    "talos_data/talos_reduced_corrected",
    "tiago_description/tiago",
    "tiago_description/tiago_dual",
    "tiago_description/tiago_no_hand",
    "tiago_pro_description/tiago_pro",
    "unimation_puma560_description/puma560_robot",
    "ur_description/ur10_joint_limited_robot",
    "ur_description/ur10_robot",
    "ur_description/ur3_gripper",
    "ur_description/ur3_joint_limited_robot",
    "ur_description/ur3_robot",
    "ur_description/ur5_gripper",
    "ur_description/ur5_joint_limited_robot",
    "ur_description/ur5_robot",
    "xarm_description/xarm7",
    "z1_description/z1",
]
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


def test_there_are_as_many_as_were_looked_at(every_published):
    """74 are read and four refused; a package that has others asks for another look."""
    assert sorted(every_published) == sorted([*READ, *REFUSED]) and len(READ) == 74


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


def test_what_moves_weighs_what_pinocchio_says(published, name, pinocchio_reads, some_coordinates):
    """Mass, centre and tensor of the whole, where no link has an inertia that no body can have."""
    if name in REFUSED:
        return
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = rs.Robot.from_urdf(published)
    if any("<inertial>" in str(w.message) or "more" in str(w.message) for w in caught):
        return
    peer = pinocchio_reads(published, robot, Path(published).stem not in MIMICS_LATER)
    q = some_coordinates(robot, 1)[0]
    peer.at(q)
    pinocchio.ccrba(peer.model, peer.data, peer.q, np.zeros(peer.model.nv))
    weights = [
        link.inertia.at(pose)
        for link, pose in zip(robot.links, robot.frames(q), strict=True)
        if link.inertia and robot.tree.find(link.name)[0]
    ]
    if weights:
        whole = reduce(add, weights)
        assert peer.data.Ig.mass == pytest.approx(whole.mass)
        np.testing.assert_allclose(peer.data.com[0], whole.centre, rtol=0, atol=TOLERANCE)
        np.testing.assert_allclose(peer.data.Ig.inertia, whole.tensor, rtol=0, atol=1e-9)


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
