"""What we write as URDF, as Pinocchio, MuJoCo and yourdfpy read it: every pose, to 1e-10."""

import mujoco
import numpy as np
import pytest
import yourdfpy

import robsim as rs

TOLERANCE = 1e-10


@pytest.fixture
def path(written, tmp_path):
    written.to_urdf(tmp_path / "robot.urdf")
    return tmp_path / "robot.urdf"


def close(a, b):
    np.testing.assert_allclose(a, b, rtol=0, atol=TOLERANCE)


def test_pinocchio_has_the_same_poses_and_jacobians(
    written, path, pinocchio_reads, some_coordinates
):
    peer = pinocchio_reads(path, written)
    frames = peer.frames()
    for q in some_coordinates(written):
        peer.at(q)
        for link in written.links:
            close(written.fk(q, link.name), peer.pose(frames[link.name]))
            close(written.jacobian(q, link.name), peer.jacobian(frames[link.name]))


def test_pinocchio_has_the_same_limits_and_masses(written, path, pinocchio_reads):
    model = pinocchio_reads(path, written).model
    for link in written.links:
        name = link.joint.name or link.name
        if link.joint.limits and link.joint.follows is None:
            joint = model.joints[model.getJointId(name)]
            limits = [model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]]
            assert tuple(limits) == link.joint.limits
    weights = [1e-3 * (k.joint.kind != "fixed") for k in written.links if k.inertial is None]
    moved = [k for k in written.links if written.tree.carries(k.name).any()]
    weights += [link.inertial.mass for link in moved if link.inertial is not None]
    assert sum(i.mass for i in list(model.inertias)[1:]) == pytest.approx(sum(weights))


def test_mujoco_has_the_same_poses(written, path, some_coordinates):
    """It merges links that do not move against each other, unless told; then nothing can float."""
    text, floats = (
        path.read_text(encoding="utf-8"),
        any(link.joint.kind == "floating" for link in written.links),
    )
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
    """It knows neither planar nor floating joints."""
    if not {link.joint.kind for link in written.links} <= {"fixed", "revolute", "prismatic"}:
        return
    peer = yourdfpy.URDF.load(str(path), load_meshes=False)
    assert peer.validate()
    ours = {name: i for i, name in enumerate(written.coordinate_names)}
    for q in some_coordinates(written):
        peer.update_cfg([q[ours[name]] for name in peer.actuated_joint_names])
        for link in written.links:
            close(written.fk(q, link.name), peer.get_transform(link.name, "base"))
