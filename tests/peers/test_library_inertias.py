"""Inertias of the library against the published numbers, in the frames and by the algorithms of
Pinocchio: gravity torques and mass matrices at random configurations."""

import numpy as np
import pinocchio
import pytest
from published_inertias import PUBLISHED

import robsim as rs

# the DH table of the Gen3 rounds lengths to 0.1 mm, its URDF to 1e-8 m
TOLERANCE = dict.fromkeys(PUBLISHED, 1e-12) | {"kinova_gen3": 5e-4}


def build_published_model(joints):
    """Return a model of Pinocchio with the published numbers."""
    model, parent = pinocchio.Model(), 0
    for each in joints:
        place = pinocchio.SE3(rs.Pose.at(*each["xyz"], rpy=each["rpy"]).matrix)
        parent = model.addJoint(parent, pinocchio.JointModelRZ(), place, each["link"])
        xx, xy, xz, yy, yz, zz = each["tensor"]
        R = rs.Pose.at(rpy=each["axes"]).rotation
        tensor = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        body = pinocchio.Inertia(each["mass"], np.array(each["centre"], float), tensor)
        model.appendBodyToJoint(parent, body, pinocchio.SE3.Identity())
    return model


def read_ours(robot, folder):
    """Return our robot as Pinocchio reads it from our URDF file."""
    robot.to_urdf(folder / "robot.urdf")
    return pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"))


def find_coordinates(model, q):
    """Return coordinates of Pinocchio: cosine and sine of a joint without limits."""
    pairs = zip(model.joints[1:], q, strict=True)
    each = [[np.cos(x), np.sin(x)] if joint.nq == 2 else [x] for joint, x in pairs]
    return np.concatenate(each)


def compute_dynamics(model, coordinates):
    """Return gravity torques (N, n) and mass matrices (N, n, n)."""
    data, gravity, masses = model.createData(), [], []
    for q in coordinates:
        x = find_coordinates(model, q)
        gravity.append(pinocchio.computeGeneralizedGravity(model, data, x).copy())
        pinocchio.crba(model, data, x)
        masses.append(np.triu(data.M) + np.triu(data.M, 1).T)
    return np.array(gravity), np.array(masses)


@pytest.mark.parametrize("name", PUBLISHED)
def test_gravity_and_mass_matrix_are_those_of_the_published_numbers(name, tmp_path):
    robot = rs.robots.load(name)
    some = np.random.default_rng(1).uniform(-3, 3, (20, robot.nq))
    ours = compute_dynamics(read_ours(robot, tmp_path), some)
    theirs = compute_dynamics(build_published_model(PUBLISHED[name]), some)
    for one, other in zip(ours, theirs, strict=True):
        tolerance = TOLERANCE[name] * np.abs(other).max()
        np.testing.assert_allclose(one, other, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", PUBLISHED)
def test_masses_are_the_published_ones(name):
    robot = rs.robots.load(name)
    links = {link.name: link for link in robot.links}
    for each in PUBLISHED[name]:
        assert links[each["link"]].inertia.mass == each["mass"]
        assert links[each["link"]].inertia.defect is None


def test_the_puma_has_the_printed_gravity_load_and_inertia(tmp_path):
    """P. I. Corke, Robotics, Vision and Control, 2011, section 9.2, at the nominal pose."""
    robot = rs.robots.puma560()
    nominal = np.array([[0, np.pi / 4, np.pi, 0, np.pi / 4, 0]])
    with pytest.warns(rs.errors.FileWarning, match="no rigid body has this inertia"):
        robot.to_urdf(tmp_path / "puma.urdf")
        rs.Robot.from_urdf(tmp_path / "puma.urdf")
    gravity, mass_matrix = compute_dynamics(read_ours(robot, tmp_path), nominal)
    printed = [0, 31.6399, 6.0351, 0, 0.0283, 0]
    np.testing.assert_allclose(gravity[0], printed, rtol=0, atol=5e-5)
    armature = [link.joint.armature for link in robot.links if link.joint.moves]
    diagonal = [3.6594, 4.4137, 0.9378, 0.1925, 0.1713, 0.1941]
    found = mass_matrix[0].diagonal() + armature
    np.testing.assert_allclose(found, diagonal, rtol=0, atol=5e-5)
