"""Angles that were meant in degrees are warned of, wherever people write them; radians never."""

import numpy as np
import pytest

import robsim as rs
from robsim.base.unit_warnings import warn_of_degrees

LINK = [[0.0, 0.0, 1.0, 0.0]]
ARM = rs.Robot.from_dh(LINK * 2)
DEGREES = {
    "rpy": (lambda: rs.Pose.at(rpy=(180, 0, 0)), r"rpy: 180 looks like .*radians\(180\) is 3.142"),
    "rotvec": (lambda: rs.Pose.at(rotvec=(10, -10, 50)), "rotvec: 50 looks like degrees"),
    "negative": (lambda: rs.Pose.at(rpy=(0, 0, -90.0)), "rpy: 90 looks like degrees"),
    "alpha": (lambda: rs.Robot.from_dh([[0, 0, 1, 90]]), r"DH rows \(theta, d, a, alpha\): 90"),
    "theta": (lambda: rs.Robot.from_dh([[-45, 0, 1, 0]]), "DH rows .*: 45 looks"),
    "limits": (lambda: rs.Robot.from_dh(LINK, limits=[[-170, 170]]), "joint limits: 170 looks"),
    "home": (lambda: rs.Robot.from_dh(LINK, home=[30]), "robot.home: 30 looks"),
    "fk": (lambda: ARM.fk([0, 90]), "q: 90 looks"),
    "roll of starts": (
        lambda: rs.starts.LookAt(distance=(1, 2), roll=(-90, 90)),
        r"LookAt.roll: 90 looks like degrees, and angles are in radians; np.radians\(90\) is 1.571",
    ),
    "turns of starts": (lambda: rs.starts.About(rpy=(0, 0, 45)), "About.rpy: 45 looks like"),
    "ik": (lambda: ARM.ik(np.eye(4), [0, 15], mask="position", restarts=0), "q0: 15 looks"),
}


DELAYS = {
    "Sensing.latency": lambda time: rs.Sensing(latency=time),
    "Sensing.period": lambda time: rs.Sensing(period=time),
    "Actuation.lag": lambda time: rs.Actuation(lag=time),
    "Latency.latency": rs.imperfections.Latency,
    "CameraPeriod.period": rs.imperfections.CameraPeriod,
    "Lag.lag": rs.imperfections.Lag,
}


@pytest.mark.parametrize("where", DELAYS)
def test_delays_in_milliseconds_are_warned_of(where):
    for plausible in (0.1, 10.0, 1e9):  # the last means that no second image follows
        DELAYS[where](plausible)
    message = f"{where}: 100 looks like milliseconds, and times are in seconds; 100 ms is 0.1"
    with pytest.warns(rs.errors.UnitWarning, match=message) as record:
        DELAYS[where](100)
    assert record[0].filename == __file__


@pytest.mark.parametrize("where", DEGREES)
def test_degrees_are_warned_of_at_every_door(where):
    call, message = DEGREES[where]
    with pytest.warns(rs.errors.UnitWarning, match=message) as record:
        call()
    assert record[0].filename == __file__  # the warning points to the caller


def test_a_start_and_a_goal_in_degrees_are_warned_of():
    camera = rs.MountedCamera("eye", rs.Camera(np.diag([500.0, 500, 1])), on="robot.link2")
    target = rs.Object("square", marks=np.eye(3) + 1.0)
    scene = rs.Scene([ARM], [target], [camera])
    with pytest.warns(rs.errors.UnitWarning, match="q0: 45 looks like degrees"):
        scene.coordinates([45.0, 0.1], "q0")
    with pytest.warns(rs.errors.UnitWarning, match="q0: 45 looks like degrees"):
        scene.coordinates({"robot": [45.0, 0.1]}, "q0")


@pytest.mark.parametrize(
    "angle",
    [
        0,
        np.pi,
        2 * np.pi,
        6.28319,
        10,
        12.5,
        4 * np.pi,
        15.5,
        47.1238898,
        1000,
        1e6,
        np.inf,
        np.nan,
    ],
)
def test_radians_are_never_warned_of(angle):
    """Multiples of pi, some turns, computed numbers, and stand-ins for no limit."""
    warn_of_degrees([0.0, angle, -angle], "angles")


def test_every_degree_that_is_round_is_warned_of():
    for angle in range(15, 721, 5):
        with pytest.warns(rs.errors.UnitWarning, match=f": {angle} looks"):
            warn_of_degrees([0.1, -angle], "angles")


def test_lengths_are_not_angles():
    """Of a sliding joint, and of a table; nor is the way of a rolling wheel a posture."""
    rs.Robot.from_dh([[0, 90, 180, 0]], joints="P", limits=[[-180, 180]]).fk([45])
    assert rs.Pose.at(90, 180, 15).position[0] == 90
    drive = rs.robots.differential_drive()
    wheels = [unit == "rad" for unit in drive.coordinate_units]
    wheels[drive.coordinate_names.index("body.theta")] = False
    drive.fk(np.where(wheels, 20.0, 0.0))
