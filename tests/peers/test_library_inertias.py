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


def compute_dynamics(model, coordinates):
    """Return gravity torques (N, n) and mass matrices (N, n, n)."""
    data, gravity, masses = model.createData(), [], []
    for q in coordinates:
        gravity.append(pinocchio.computeGeneralizedGravity(model, data, q).copy())
        pinocchio.crba(model, data, q)
        masses.append(np.triu(data.M) + np.triu(data.M, 1).T)
    return np.array(gravity), np.array(masses)


@pytest.mark.parametrize("name", PUBLISHED)
def test_gravity_and_mass_matrix_are_those_of_the_published_numbers(name):
    robot = rs.robots.load(name)
    some = np.random.default_rng(1).uniform(-3, 3, (20, robot.nq))
    armature = np.diag([link.joint.armature for link in robot.links if link.joint.moves])
    ours = robot.gravity(some), robot.mass_matrix(some) - armature
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
