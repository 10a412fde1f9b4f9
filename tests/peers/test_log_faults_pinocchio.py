"""Faults of a robot that Pinocchio moves and a camera that OpenCV projects, named by `explain`."""

from dataclasses import replace

import cv2
import numpy as np
import pandas
import pinocchio as pin
import plant
import pytest

import robsim as rs


def build_arm():
    """The arm of `plant` as a model of Pinocchio, and the placement of its flange."""
    model, parent, place = pin.Model(), 0, pin.SE3.Identity()
    for i, (theta, d, a, alpha) in enumerate(plant.UR5):
        turn = pin.SE3(pin.utils.rotate("z", theta), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRZ(), place * turn, f"joint{i}")
        place = pin.SE3(pin.utils.rotate("x", alpha), np.array([a, 0.0, d]))
    return model, place


MODEL, FLANGE = build_arm()
DATA = MODEL.createData()


def flange(q):
    """The pose (4, 4) of the flange by Pinocchio."""
    pin.forwardKinematics(MODEL, DATA, np.asarray(q, float))
    return (DATA.oMi[6] * FLANGE).homogeneous


def project(X, K, lens):
    """The pixels (N, 2) of points in camera axes by OpenCV."""
    zero = np.zeros(3)
    return cv2.projectPoints(X, zero, zero, K, np.array(lens))[0].reshape(-1, 2)


@pytest.mark.parametrize("kind", ["mount", "joint offset", "distortion"])
def test_a_fault_of_a_robot_of_other_programs_is_named(kind):
    rng = np.random.default_rng(9)
    cell = replace(plant.cell(), flange=flange, project=project)
    np.testing.assert_allclose(flange(plant.HOME), plant.flange(plant.HOME), atol=1e-12)
    made = plant.experiment(cell, plant.start_near(rng))
    quiet = plant.Drive(noise=0.5, jitter=0.1)

    def explain(real, drive):
        table = pandas.DataFrame(plant.record(made, real, drive, 1))
        return rs.explain(rs.logs.read_log(table, made), trials=False)

    assert explain(cell, quiet).causes == ()
    real, drive, words = plant.FAULTS[kind](cell, quiet, rng)
    (finding,) = explain(real, drive).causes
    assert all(word in f"{finding.about} | {finding.sentence}" for word in words)
