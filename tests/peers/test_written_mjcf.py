"""What we write as MJCF, as MuJoCo reads it: poses to 1e-10, limits, masses, equalities."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import robsim as rs

TOLERANCE = 1e-10


@pytest.fixture
def model(written, tmp_path):
    return made(written, tmp_path)


def made(robot, folder):
    robot.to_mjcf(folder / "robot.xml")
    return mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))


def close(a, b):
    np.testing.assert_allclose(a, b, rtol=0, atol=TOLERANCE)


def put(model, robot, q):
    """Coordinates into MuJoCo, by their names; a free joint has the pose of its body."""
    data, values = mujoco.MjData(model), dict(zip(robot.coordinate_names, q, strict=True))
    for link in robot.links:
        name, follows = link.joint.name or link.name, link.joint.follows
        if follows is not None:
            values[name] = follows.ratio * values[follows.of] + follows.offset
        if link.joint.kind == "floating":
            x, y, z, w = rs.Pose(robot.fk(q, link.name)).quaternion
            data.joint(name).qpos = *robot.fk(q, link.name)[:3, 3], w, x, y, z
    for i in range(model.njnt):
        name = model.joint(i).name
        if name in values:
            data.joint(name).qpos = values[name]
    mujoco.mj_forward(model, data)
    return data


def agree(model, robot, coordinates):
    for q in coordinates:
        data = put(model, robot, q)
        for link in robot.links:
            body = data.body(link.name)
            close(body.xpos, robot.fk(q, link.name)[:3, 3])
            close(body.xmat.reshape(3, 3), robot.fk(q, link.name)[:3, :3])


def test_mujoco_has_the_same_poses(written, model, some_coordinates):
    agree(model, written, some_coordinates(written))


def test_mujoco_has_the_same_limits_and_inertias(written, model):
    for link in written.links:
        if link.joint.limits is not None:
            joint = model.joint(link.joint.name or link.name)
            assert tuple(joint.range) == link.joint.limits and joint.limited
        moves = link.joint.kind != "fixed"
        mass = link.inertial.mass if link.inertial else 1e-3 * moves
        assert model.body(link.name).mass == pytest.approx(mass, rel=1e-15)
        if link.inertial:
            close(model.body(link.name).ipos, link.inertial.centre)
            moments = np.linalg.eigvalsh(link.inertial.tensor)
            np.testing.assert_allclose(np.sort(model.body(link.name).inertia), moments, rtol=1e-9)


def test_mujoco_has_the_same_tensors_of_leaning_blocks(written, tmp_path):
    links = [
        replace(link, inertia=rs.Block(0.3, 0.2, 0.1, mass=1 + i).at(lean(i)).inertia)
        for i, link in enumerate(written.links)
    ]
    model = made(replace(written, links=links), tmp_path)
    for link in links:
        body, R = model.body(link.name), np.empty(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        R = R.reshape(3, 3)
        close(body.ipos, link.inertia.centre)
        close(R @ np.diag(body.inertia) @ R.T, link.inertia.tensor)


def lean(i):
    return rs.Pose.at(0.1 * i, -0.2, 0.3, rpy=(0.4, i, 2.0))


def test_mujoco_ties_what_mimics(written, model, some_coordinates):
    """Where our coordinates are, its equality constraints are kept."""
    for q in some_coordinates(written):
        data = put(model, written, q)
        close(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY], 0.0)
    assert model.neq == sum(link.joint.follows is not None for link in written.links)


def test_a_tree_of_all_kinds_has_the_same_poses(tmp_path, some_coordinates):
    """Everywhere constant poses on both sides of the motion, and a body that flies."""
    rng = np.random.default_rng(3)

    def joint(kind, **more):
        place, tail = (rs.Pose.at(*rng.normal(size=3), rpy=rng.normal(size=3)) for _ in range(2))
        return rs.Joint(kind, place, tail, **more)

    def solid():
        return rs.Block(0.1, 0.2, 0.3, mass=2).at(rs.Pose.at(0.1, rpy=(1, 2, 3)))

    links = [
        rs.Link("base"),
        rs.Link("deck", "base", joint("planar"), (solid(),)),
        rs.Link("plate", "deck", joint("fixed"), (rs.Wheel(0.1, 0.2, mass=1), rs.Ball(0.1))),
        rs.Link("arm", "plate", joint("revolute", effort=3.0)),
        rs.Link("shelf", "base", joint("fixed")),
        rs.Link("drone", "shelf", joint("floating"), (rs.CameraBody(0.1, 0.2, 0.3),)),
        rs.Link("slide", "drone", joint("prismatic", name="lift", limits=(-1.0, 3.0))),
    ]
    robot = rs.Robot("all", links)
    model = made(robot, tmp_path)
    agree(model, robot, some_coordinates(robot))
    assert tuple(model.jnt_actfrcrange[model.joint("arm").id]) == (-3.0, 3.0)
    assert model.ngeom == 5
