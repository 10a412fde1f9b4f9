"""Our MJCF files, as MuJoCo reads them: poses to 1e-10, limits, masses, equalities."""

import warnings
from dataclasses import replace

import mujoco
import numpy as np
import pytest

import robsim as rs
from robsim.robot.urdf.mjcf_writer import LEAST_MASS, _raise_moments
from robsim.robot.urdf.urdf_link import TOKEN_INERTIA

TOLERANCE = 1e-10


@pytest.fixture
def model(written, tmp_path):
    return load_in_mujoco(written, tmp_path)


def load_in_mujoco(robot, folder):
    with warnings.catch_warnings():  # of inertias that MuJoCo refuses, as of the Puma
        warnings.filterwarnings("ignore", ".*inertias of", rs.errors.FileWarning)
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
            body = rs.Pose(robot.fk(q, link.name))
            data.joint(name).qpos = *body.position, *np.roll(body.quaternion, 1)
    for i in range(model.njnt):
        name = model.joint(i).name
        if name in values:
            data.joint(name).qpos = values[name]
    mujoco.mj_forward(model, data)
    return data


def test_mujoco_has_the_same_poses(written, model, some_coordinates):
    for q in some_coordinates(written):
        data = put(model, written, q)
        for link in written.links:
            body = data.body(link.name)
            close(body.xpos, written.fk(q, link.name)[:3, 3])
            close(body.xmat.reshape(3, 3), written.fk(q, link.name)[:3, :3])


def test_mujoco_has_the_same_limits_and_inertias(written, model):
    for link in written.links:
        if link.joint.limits is not None:
            joint = model.joint(link.joint.name or link.name)
            assert tuple(joint.range) == link.joint.limits and joint.limited
        moves = link.joint.kind != "fixed"
        mass = link.inertial.mass if link.inertial else TOKEN_INERTIA.mass * moves
        if link.inertial:
            mass = link.inertial.mass or LEAST_MASS
        assert model.body(link.name).mass == pytest.approx(mass, rel=1e-15)
        if link.inertial:
            close(model.body(link.name).ipos, link.inertial.centre)
            moments = np.linalg.eigvalsh(_raise_moments(link.inertial.tensor))
            np.testing.assert_allclose(np.sort(model.body(link.name).inertia), moments, rtol=1e-9)


def test_mujoco_has_the_same_tensors_of_leaning_blocks(written, tmp_path):
    links = [
        replace(link, inertia=rs.Block(0.3, 0.2, 0.1, mass=1 + i).at(lean(i)).inertia)
        for i, link in enumerate(written.links)
    ]
    model = load_in_mujoco(replace(written, links=links), tmp_path)
    for link in links:
        body, R = model.body(link.name), np.empty(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        R = R.reshape(3, 3)
        close(body.ipos, link.inertia.centre)
        close(R @ np.diag(body.inertia) @ R.T, link.inertia.tensor)


def lean(i):
    return rs.Pose.at(0.1 * i, -0.2, 0.3, rpy=(0.4, i, 2.0))


def test_mujoco_ties_mimics(written, model, some_coordinates):
    """Where our coordinates are, its equality constraints are kept."""
    for q in some_coordinates(written):
        data = put(model, written, q)
        close(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY], 0.0)
    assert model.neq == sum(link.joint.follows is not None for link in written.links)


def test_mujoco_has_the_same_largest_efforts(written, model):
    for link in written.links:
        if link.joint.effort is not None:
            number = model.joint(link.joint.name or link.name).id
            assert model.jnt_actfrcrange[number].tolist() == [-link.joint.effort, link.joint.effort]


def test_mujoco_has_as_many_geoms_as_there_are_shapes(written, model):
    """The body of a camera is two, and a tapered cylinder four cylinders."""
    shapes = [shape for link in written.links for shape in link.shapes]
    kinds = [type(shape) for shape in shapes]
    more = kinds.count(rs.CameraBody) + 3 * kinds.count(rs.shapes.TaperedCylinder)
    assert model.ngeom == len(shapes) + more


@pytest.mark.parametrize("density", [1.0, 700.0])
def test_mujoco_weighs_a_capsule_as_we_do(density):
    """By its own formulas, in a body that takes its inertia from its geom."""
    capsule = rs.shapes.Capsule(0.07, 0.3, density=density)
    geom = f'<geom type="capsule" size="0.07 0.15" density="{density}"/>'
    body = f"<mujoco><worldbody><body>{geom}</body></worldbody></mujoco>"
    read = mujoco.MjModel.from_xml_string(body)
    np.testing.assert_allclose(read.body_mass[1], capsule.inertia.mass, rtol=1e-12)
    moments = np.sort(np.diag(capsule.inertia.tensor))
    np.testing.assert_allclose(np.sort(read.body_inertia[1]), moments, rtol=1e-12)
