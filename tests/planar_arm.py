"""The planar arm of `tests/oracles/generate_torque_law.py`, and its stored trajectories."""

import json
import runpy
from pathlib import Path

import numpy as np

import robsim as rs

ORACLES = Path(__file__).parent / "oracles"
PLANAR = runpy.run_path(str(ORACLES / "_planar_arm.py"))
STORED = json.loads((ORACLES / "torque_law_scipy.json").read_text(encoding="utf-8"))
CASES = {case["name"]: case for case in STORED["cases"]}
TIMES, GOAL = np.array(STORED["times"]), PLANAR["GOAL"]


def build_arm(masses=(PLANAR["M1"], PLANAR["M2"])):
    """The arm with the joint axes along -y; it hangs down at q = 0."""
    first = rs.Pose.at(rpy=(np.pi / 2, 0, 0))
    second = rs.Pose.at(0, -PLANAR["L1"], 0)
    centres, moments = (PLANAR["C1"], PLANAR["C2"]), (PLANAR["I1"], PLANAR["I2"])
    inertias = [
        rs.shapes.Inertia(mass, (0, -centre, 0), moment * np.eye(3))
        for mass, centre, moment in zip(masses, centres, moments, strict=True)
    ]
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("upper", "base", rs.joints.Joint("revolute", first), inertia=inertias[0]),
        rs.joints.Link("fore", "upper", rs.joints.Joint("revolute", second), inertia=inertias[1]),
    ]
    return rs.Robot("arm", links, tip="fore")


def place_camera(roll):
    """The fixed camera before the plane of the arm, rolled about its optical axis."""
    (x, z), distance = PLANAR["CENTRE"], PLANAR["DISTANCE"]
    facing = rs.Pose.at(x, -distance, z, rpy=(-np.pi / 2, 0, 0)) @ rs.Pose.at(rotvec=(0, 0, roll))
    eye = rs.Camera([[800, 0, 400], [0, 800, 400], [0, 0, 1]])
    return rs.MountedCamera("camera", eye, pose=facing)


def build_scene(roll, **arm):
    """The arm with a mark at its tip, and the camera."""
    tip = rs.Object("tip", marks=[[0, 0, 0]], on="arm.fore", pose=rs.Pose.at(0, -PLANAR["L2"], 0))
    return rs.Scene([build_arm(**arm)], [tip], [place_camera(roll)])


def build_task(case, **fields):
    """The task of a stored case, with the belief of its camera."""
    law = rs.laws.TorqueLaw(case["stiffness"], case["width"])
    believed = build_scene(case["roll"] + case["roll_error"]) if case["roll_error"] else None
    return rs.IBVS(GOAL, law=law, belief=believed, **{"tolerance": 1e-9, **fields})
