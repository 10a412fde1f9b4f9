"""Arms with weight, and experiments of image-based servoing with drives, for tests."""

from dataclasses import replace

import numpy as np

import robsim as rs
from robsim.joints import Joint, Link
from robsim.shapes import Inertia

HOME = np.array([0.5, -0.7])
UPRIGHT = rs.Pose.at(rpy=(np.pi / 2, 0, 0))  # positive angles raise the links
EYE = rs.Camera([[800, 0, 500], [0, 800, 500], [0, 0, 1]])
FOCAL = 800.0
MARKS = np.array([[-0.06, -0.06, 0], [0.06, -0.05, 0], [0.05, 0.06, 0], [-0.06, 0.05, 0.02]])


def build_arm(masses=(2.0, 2.0), armature=(0.1, 0.05), damping=(0.5, 0.2), **joints):
    """A vertical arm with two links; `joints` are pairs of further numbers of the joints."""

    def make_joint(i, place):
        numbers = {name: pair[i] for name, pair in joints.items()}
        resist = {"armature": float(armature[i]), "damping": float(damping[i])}
        return Joint("revolute", place=place, **resist, **numbers)

    rod = np.diag([0.005, 0.025, 0.025])
    inertias = [Inertia(float(mass), (0.25, 0, 0), mass * rod) for mass in masses]
    links = [
        Link("base"),
        Link("upper", "base", make_joint(0, UPRIGHT), inertia=inertias[0]),
        Link("fore", "upper", make_joint(1, rs.Pose.at(0.5, 0, 0)), inertia=inertias[1]),
        Link("tip", "fore", Joint(place=rs.Pose.at(0.5, 0, 0))),
    ]
    return rs.Robot("arm", links, home=HOME)


def servo(drive, dt=0.01, gain=2.0, latency=0.0, offset=(0.01, -0.012), duration=4.0, **more):
    """A camera beside the arm drives its tip to the image at HOME + offset of the start."""
    arm = {name: more.pop(name) for name in ("masses", "friction", "effort") if name in more}
    arm |= {name: more.pop(name) for name in ("armature", "damping") if name in more}
    side = rs.Pose.at(0.5, -1.5, 0.1, rpy=(-np.pi / 2, 0, 0))
    eye = rs.MountedCamera("eye", EYE, pose=side)
    tip = rs.Object("tip", marks=[[0, 0, 0]], on="arm.tip")
    return rs.Experiment(
        rs.Scene([build_arm(**arm)], [tip], [eye]),
        rs.IBVS(HOME, gain=gain, joints=more.pop("joints", None)),
        start=HOME + offset,
        dt=dt,
        duration=duration,
        actuation=rs.Actuation(drive=drive, **more),
        sensing=rs.Sensing(latency=latency),
    )


def servo_six_joints(name, drive, dt, latency):
    """A camera in the hand of a robot of the library, without friction and torque limits."""
    robot = getattr(rs.robots, name)()
    home = {
        "puma560": np.radians([1, 81, -199, 1, -61, 2]),
        "ur5e": np.array([0.2, -1.6, 1.5, -1.4, -1.5, 0.3]),
    }[name]
    links = [
        replace(link, joint=replace(link.joint, friction=0.0, effort=None)) for link in robot.links
    ]
    robot = replace(robot, links=tuple(links), home=home)
    hand = f"{name}.{robot.links[-1].name}"
    plate = rs.Pose(np.asarray(rs.Scene([robot]).pose(hand))) @ rs.Pose.at(0, 0, 0.5)
    return rs.Experiment(
        rs.Scene(
            [robot],
            [rs.Object("plate", marks=MARKS, pose=plate)],
            [rs.MountedCamera("eye", EYE, on=hand)],
        ),
        rs.IBVS(gain=2.0),
        start=home + 1e-4,
        dt=dt,
        actuation=rs.Actuation(drive=drive),
        sensing=rs.Sensing(latency=latency),
    )
