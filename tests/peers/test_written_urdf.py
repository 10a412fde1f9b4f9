"""Our URDF files, as Pinocchio, MuJoCo and yourdfpy read them: every pose, to 1e-10."""

from dataclasses import replace
from functools import reduce
from operator import add

import mujoco
import numpy as np
import pinocchio
import pytest
import yourdfpy

import robsim as rs

TOLERANCE = 1e-10
# the name of a follower comes before the name of its leader, which Pinocchio does not read;
# it then ignores that the joint follows
MIMICS_LATER = ("rhino_gripper",)


@pytest.fixture
def path(written, tmp_path):
    written.to_urdf(tmp_path / "robot.urdf")
    return tmp_path / "robot.urdf"


def close(a, b):
    np.testing.assert_allclose(a, b, rtol=0, atol=TOLERANCE)


def test_pinocchio_has_the_same_poses_and_jacobians(
    written, path, pinocchio_reads, some_coordinates
):
    mimic = written.name not in MIMICS_LATER
    peer = pinocchio_reads(path, written, mimic)
    frames = peer.frames()
    for q in some_coordinates(written):
        peer.at(q)
        for link in written.links:
            close(written.fk(q, link.name), peer.pose(frames[link.name]))
            if mimic:
                close(written.jacobian(q, link.name), peer.jacobian(frames[link.name]))


def test_pinocchio_has_the_same_limits_and_masses(written, path, pinocchio_reads):
    model = pinocchio_reads(path, written, written.name not in MIMICS_LATER).model
    for link in written.links:
        name = link.joint.name or link.name
        if link.joint.limits and link.joint.follows is None:
            joint = model.joints[model.getJointId(name)]
            limits = [model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]]
            assert tuple(limits) == link.joint.limits
    weights = [1e-3 * (k.joint.kind != "fixed") for k in written.links if k.inertial is None]
    moved = [k for k in written.links if written.tree.flag_velocities(k.name).any()]
    weights += [link.inertial.mass for link in moved if link.inertial is not None]
    assert sum(i.mass for i in list(model.inertias)[1:]) == pytest.approx(sum(weights))


def test_pinocchio_has_the_same_inertia_of_all_that_moves(
    written, tmp_path, pinocchio_reads, some_coordinates
):
    """Mass, centre, and the tensor about it, with a leaning block for each link."""
    links = [replace(link, inertia=leaning(i)) for i, link in enumerate(written.links)]
    robot = replace(written, links=links)
    robot.to_urdf(tmp_path / "weighed.urdf")
    peer = pinocchio_reads(tmp_path / "weighed.urdf", robot, written.name not in MIMICS_LATER)
    for q in some_coordinates(robot):
        peer.at(q)
        pinocchio.ccrba(peer.model, peer.data, peer.q, np.zeros(peer.model.nv))
        placed = zip(links, robot.frames(q), strict=True)
        ours = [link.inertia.at(pose) for link, pose in placed if carried(robot, link)]
        if ours:
            whole = reduce(add, ours)
            assert peer.data.Ig.mass == pytest.approx(whole.mass)
            close(peer.data.com[0], whole.centre)
            close(peer.data.Ig.inertia, whole.tensor)


def leaning(i):
    at = rs.Pose.at(0.1 * i, -0.2, 0.3, rpy=(0.4, i, 2.0))
    return rs.Block(0.3, 0.2, 0.1, mass=1.0 + i).at(at).inertia


def carried(robot, link):
    """Whether the link moves, or hangs from a moving link."""
    while link.parent is not None and link.joint.kind == "fixed":
        link = next(other for other in robot.links if other.name == link.parent)
    return link.parent is not None


def test_mujoco_has_the_same_poses(written, path, some_coordinates):
    """It merges links that do not move against each other, by default; then nothing can float."""
    text, floats = (
        path.read_text(encoding="utf-8"),
        any(link.joint.kind == "floating" for link in written.links),
    )
    if any(link.inertial and link.inertial.defect for link in written.links):
        with pytest.raises(ValueError, match="inertia must have positive eigenvalues"):
            mujoco.MjModel.from_xml_string(text)  # its MJCF file has other moments
        return
    keep = '<mujoco><compiler fusestatic="false"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(text if floats else text.replace('">', f'">{keep}', 1))
    data = mujoco.MjData(model)
    bodies = {model.body(i).name for i in range(model.nbody)}
    for q in some_coordinates(written):
        put(model, data, written, q)
        for link in written.links:
            if floats and link.name not in bodies:
                continue
            close(data.body(link.name).xpos, written.fk(q, link.name)[:3, 3])
            close(data.body(link.name).xmat.reshape(3, 3), written.fk(q, link.name)[:3, :3])


def put(model, data, robot, q):
    """Coordinates, and those that follow them, into MuJoCo."""
    values = dict(zip(robot.coordinate_names, q, strict=True))
    for link in robot.links:
        name, follows = link.joint.name or link.name, link.joint.follows
        if follows is not None:
            values[name] = follows.ratio * values[follows.of] + follows.offset
        elif link.joint.kind == "floating":
            flies = rs.Pose(robot.fk(q, link.name)) @ link.joint.tail.inv()  # in the world
            data.joint(name).qpos = *flies.position, *np.roll(flies.quaternion, 1)
        elif link.joint.kind == "planar":
            for part, theirs in ((".x", "_TX"), (".y", "_TY"), (".theta", "_RZ")):
                data.joint(name + theirs).qpos = values[name + part]
        if name in values:
            data.joint(name).qpos = values[name]
    mujoco.mj_kinematics(model, data)


def test_yourdfpy_has_the_same_poses(written, path, some_coordinates):
    """It supports neither planar nor floating joints."""
    if not {link.joint.kind for link in written.links} <= {"fixed", "revolute", "prismatic"}:
        return
    peer = yourdfpy.URDF.load(str(path), load_meshes=False)
    assert peer.validate()
    ours = {name: i for i, name in enumerate(written.coordinate_names)}
    root = written.links[0].name
    for q in some_coordinates(written):
        peer.update_cfg([q[ours[name]] for name in peer.actuated_joint_names])
        for link in written.links:
            close(written.fk(q, link.name), peer.get_transform(link.name, root))


def test_the_element_that_names_the_tip_is_left_out_by_the_others(tmp_path):
    arm = rs.robots.panda()
    path = tmp_path / "robot.urdf"
    replace(arm, tip=arm.links[3].name).to_urdf(path)
    assert "<robsim tip=" in path.read_text(encoding="utf-8")
    assert pinocchio.buildModelFromUrdf(str(path)).nq == arm.nq
    assert mujoco.MjModel.from_xml_path(str(path)).nq == arm.nq
    peer = yourdfpy.URDF.load(str(path), load_meshes=False)
    assert peer.validate() and len(peer.actuated_joint_names) == arm.nq
