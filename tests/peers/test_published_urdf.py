"""Every plain URDF of sixteen packages: read, or refused with a reason; its poses, and its tip.

Of 291 files Pinocchio reads 275, and this reader 271: the other four do not define their motion, or
are no XML. Before shapes and inertias that cannot be used were left out, it was 216.
"""

import warnings
from functools import reduce
from operator import add
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robsim as rs

TOLERANCE = 1e-10
FILES = {  # how many there are, and how many of these are read
    "example-robot-data": (69, 67),
    "rtb-data": (9, 8),
    "airo-models": (16, 16),
    "armar": (8, 4),
    "dexmate-urdf": (26, 26),
    "differentiable-robot-model": (13, 13),
    "gym-ignition-models": (6, 6),
    "hello-robot-stretch-urdf": (13, 13),
    "hello-robot-stretch4-urdf": (6, 6),
    "jvrc-description": (1, 1),
    "orca-arm": (1, 1),
    "pybullet": (95, 85),
    "robot-properties-fingers": (14, 11),
    "synriard": (9, 9),
    "upkie-description": (2, 2),
    "urdfenvs": (3, 3),
}
PINOCCHIO_ONLY = {
    # joints that mimic a joint which does not exist
    "example-robot-data/alex_description/urdf/alex_psyonic_hands": "mimic: no joint 'index_q1'",
    "pybullet/pybullet_data/cube_no_rotation": "lower 1 is above upper -1; it must be below",
    # it begins with an empty line
    "pybullet/pybullet_data/differential/diff_ring": ":2: not valid XML: XML or text declaration",
    # two axes
    "pybullet/pybullet_data/quadruped/spirit40newer": "<axis>: there is one already; only one",
}
COMMA = "is no number; a decimal point is allowed, and spaces between numbers"
REFUSED = {
    **PINOCCHIO_ONLY,
    "example-robot-data/ur_description/urdf/ur3": "<robot>: 0 links; from 1 to 2048 are allowed",
    "rtb-data/rtbdata/data/test": ":1: not valid XML: syntax error",
    **{
        f"armar/description/urdf/{name}": COMMA
        for name in ("armar6", "armar6_front", "armar6_x4", "armar6_x4_front")
    },
    "pybullet/pybullet_data/bicycle/bike": COMMA,
    "pybullet/pybullet_data/biped/biped2d_pybullet": ":4: not valid XML: XML or text declaration",
    "pybullet/pybullet_data/humanoid/humanoid": ":288: not valid XML: not well-formed",
    "pybullet/pybullet_data/husky/husky": "an expression of xacro; expand the file first",
    "pybullet/quadruped/microtaur/microtaur": "expected 3 numbers, got more",
    "pybullet/pybullet_data/spherical_joint_limit": "no joint type 'spherical'; types: fixed",
    "pybullet/pybullet_data/torus_deform": "<robot 'torus'>: 0 links; from 1 to 2048 are allowed",
    "robot-properties-fingers/urdf/edu/trifingeredu_stage": "parent: no link 'base_link'",
    "robot-properties-fingers/robot_properties_fingers/urdf/trifinger_stage": "parent: no link",
    "robot-properties-fingers/robot_properties_fingers/urdf/finger_macro": "<robot>: 0 links",
}
TIPS = {  # the link of the hand of an arm, without any other information
    "rtb-data/abb_irb140_description/urdf/irb140": "tool0",
    "rtb-data/abb_irb140_description/urdf/irb140QT": "tool0",
    "rtb-data/kuka_kr120/urdf/kr120r2500pro": "tool0",
    "rtb-data/kuka_kr16/urdf/kr16_2": "tool0",
    "rtb-data/kuka_kr210/urdf/kr210l150": "tool0",
    "rtb-data/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820": "tool0",
    "rtb-data/lynxmotion_al5d_description/urdf/al5d_robot": "link4",
    "rtb-data/unimation_puma560_description/urdf/puma560_robot": "link7",
    "example-robot-data/kinova_description/robots/kinova": "j2s6s200_end_effector",
    "example-robot-data/panda_description/urdf/panda": "panda_hand_tcp",
    "example-robot-data/ur_description/urdf/ur5_robot": "tool0",
    "example-robot-data/ur_description/urdf/ur10_robot": "tool0",
    "example-robot-data/xarm_description/urdf/xarm7": "link_eef",
    "example-robot-data/tiago_description/robots/tiago": "hand_tool_link",
}
# a joint mimics one that comes later in the tree, which Pinocchio does not read
MIMICS_LATER = ("romeo", "talos_full_v2", "talos_full_v2_box", "jvrc1")
THOROUGHLY = ("panda", "ur5_robot", "lbr_iiwa_14_r820")


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        return rs.Robot.from_urdf(path)


def test_there_are_as_many_as_were_looked_at(every_published):
    """A package with other files has to be examined anew."""
    counts = {
        package: (len(names), sum(name not in REFUSED for name in names))
        for package, names in every_published.items()
    }
    assert counts == {package: FILES[package] for package in counts}
    assert {"example-robot-data", "rtb-data"} <= set(counts)
    assert [sum(column) for column in zip(*FILES.values(), strict=True)] == [291, 271]


@pytest.fixture
def name(published, request):
    return request.node.callspec.id


def test_pinocchio_refuses_it_too_or_only_for_other_reasons(published, name):
    if name in REFUSED and name not in PINOCCHIO_ONLY:
        with pytest.raises(ValueError, match=r".+"):
            pinocchio.buildModelFromUrdf(str(published))
    else:
        pinocchio.buildModelFromUrdf(str(published))


def test_the_tip_of_an_arm_is_its_hand_and_where_pinocchio_has_it(published, name, pinocchio_reads):
    if name not in TIPS:
        return
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = rs.Robot.from_urdf(published)
    assert robot.tip == TIPS[name] and not any("tip" in str(w.message) for w in caught)
    peer = pinocchio_reads(published, robot).at(robot.home)
    theirs = peer.pose(peer.frames()[TIPS[name]])
    np.testing.assert_allclose(robot.fk(robot.home), theirs, rtol=0, atol=TOLERANCE)
    assert np.linalg.matrix_rank(robot.jacobian(robot.home + 0.1)) == min(6, robot.nq)


def test_it_is_read_and_has_the_poses_of_pinocchio_or_it_is_refused(
    published, name, pinocchio_reads, some_coordinates
):
    if name in REFUSED:
        with pytest.raises(rs.errors.FileError) as caught:
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


def test_moving_links_have_pinocchios_masses(published, name, pinocchio_reads, some_coordinates):
    """Mass, centre and tensor of the whole, also with inertias that no rigid body can have."""
    if name in REFUSED:
        return
    robot = read(published)
    peer = pinocchio_reads(published, robot, Path(published).stem not in MIMICS_LATER)
    q = some_coordinates(robot, 1)[0]
    peer.at(q)
    pinocchio.ccrba(peer.model, peer.data, peer.q, np.zeros(peer.model.nv))
    weights = [
        link.inertia.at(pose)
        for link, pose in zip(robot.links, robot.frames(q), strict=True)
        if link.inertia and robot.tree.find(link.name)[0]
    ]
    every = sum(link.inertia.mass for link in robot.links if link.inertia)
    total = sum(inertia.mass for inertia in peer.model.inertias)  # of the base, too
    np.testing.assert_allclose(every, total, rtol=1e-12, atol=0)
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
    back = read(tmp_path / "robot.urdf")
    assert back.tip == robot.tip
    assert [k.name for k in back.links] == [k.name for k in robot.links]
    assert back.coordinate_names == robot.coordinate_names
    assert [k.inertia for k in back.links] == [k.inertia for k in robot.links]
    np.testing.assert_array_equal(back.limits, robot.limits)
    q = some_coordinates(robot)
    np.testing.assert_allclose(back.frames(q), robot.frames(q), rtol=0, atol=1e-12)
