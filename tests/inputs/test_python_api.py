"""Bad input to the Python API is one clear error; a run that goes wrong is data with an outcome."""

import re
import signal
import subprocess
import sys
import threading
import warnings
from dataclasses import dataclass

import numpy as np
import pytest

import robsim as rs
from robsim.engine.outcome import Outcome

NAN, INF = float("nan"), float("inf")
K = [[800, 0, 320], [0, 800, 240], [0, 0, 1]]
SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GOAL = rs.Pose.at(0, 0, -0.6)
START = rs.Pose.at(0.05, -0.02, -0.8, rotvec=(0.1, -0.1, 0.3))
BEHIND = rs.Pose.at(0, 0, 0.6)
ASIDE = rs.Pose.at(1, 0, -0.6)


def turned(degrees):
    """The goal, turned about the optical axis."""
    return GOAL @ rs.Pose.at(rotvec=(0, 0, np.radians(degrees)))


def flying(marks=SQUARE, size=None):
    """A free camera that looks at marks."""
    body = rs.joints.Link("body", "base", rs.joints.Joint("floating"))
    robot = rs.Robot("free", [rs.joints.Link("base"), body])
    eye = rs.MountedCamera("eye", rs.Camera(K, size), on="free.body")
    return rs.Scene([robot], [rs.Object("dots", marks=marks)], [eye])


def lift():
    """A camera on one prismatic joint from 0 to 0.5 m along its optical axis, and one mark."""
    arm = rs.Robot.from_dh([[0, 0, 0, 0]], joints="P", limits=[[0, 0.5]], name="lift")
    eye = rs.MountedCamera("eye", rs.Camera(K), on="lift.link1")
    return rs.Scene([arm], [rs.Object("dot", marks=[[0.1, 0, 1]])], [eye])


def turret(limit=4.0, marks=((0, 0, 1),), size=(640, 480)):
    """A camera that one joint turns about its vertical axis, y down."""
    upright = rs.Pose.at(rpy=(-np.pi / 2, 0, 0))
    joint = rs.joints.Joint("revolute", rs.Pose.at(rpy=(np.pi / 2, 0, 0)), limits=(-limit, limit))
    robot = rs.Robot("turret", [rs.joints.Link("base"), rs.joints.Link("head", "base", joint)])
    eye = rs.MountedCamera("eye", rs.Camera(K, size), on="turret.head", pose=upright)
    return rs.Scene([robot], [rs.Object("dots", marks=marks)], [eye])


def two_arms():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]], name="a", limits=[[-1, 1]])
    eye = rs.MountedCamera("eye", rs.Camera(K), on="a.link1")
    return rs.Scene([arm, arm.named("b")], [rs.Object("dot", marks=[[1, 0, 1]])], [eye])


def simulate(q0=START, scene=None, goal=GOAL, duration=0.2, task=None, **settings):
    """A short run of IBVS; keywords of IBVS in `task`."""
    servo = rs.IBVS(goal=goal, **(task or {}))
    return rs.simulate(scene or flying(), servo, q0, duration=duration, **settings)


def outcome(run):
    return Outcome(int(run.outcome))


class Unmeasured:
    """A feature of a user's that lacks a unit and a tolerance."""

    def measure(self, seen):
        return seen.depth[:, :1]


class Plain:
    """Normalised points, as a user would write them."""

    unit, tolerance = "1", 1e-5

    def measure(self, seen):
        return seen.points.reshape(len(seen.points), -1)

    def interaction(self, seen):
        return rs.features.Points().interaction(seen)


class Law:
    """The joint law, as a user would wrap it."""

    def command(self, state):
        return rs.laws.JointLaw().command(state)


# ---- refusals: (name, call, exception, part of the message) ----

SIMULATE = {
    "dt": [
        (0, "dt (seconds) must be a positive number, got 0"),
        (-0.04, "got -0.04"),
        (NAN, "dt (seconds): nan", "must be finite"),
        (INF, "dt (seconds): inf", "must be finite"),
        (None, "dt (seconds)"),
        ("40 ms", "dt (seconds): expected a number", "'40 ms'"),
        ([0.1, 0.2], "dt (seconds)", "got [0.1, 0.2]"),
        (1j, "dt (seconds)"),
        (1e-320, "at most 10 million"),
    ],
    "duration": [
        (0, "duration (seconds) must be a positive number, got 0"),
        (-1, "got -1"),
        (NAN, "duration (seconds): nan"),
        (INF, "duration (seconds): inf"),
        ("10 s", "duration (seconds)", "'10 s'"),
        (1e9, "duration 1e+09 s", "0.04 s", "2.5e+10 steps", "at most 10 million"),
        (1e300, "duration 1e+300 s", "at most 10 million"),
    ],
    "seed": [
        (-1, "seed must be a whole number from 0 on, got -1"),
        (1.5, "seed", "got 1.5"),
        (NAN, "seed: nan"),
        (True, "seed", "got True"),
        ("one", "seed", "'one'"),
        ([1, 2], "seed", "got [1, 2]"),
        (2**64, "seed must be below", str(2**64)),
    ],
    "sensing": [
        (0.5, "sensing: expected a Sensing, got 0.5"),
        (rs.Actuation(), "sensing: expected a Sensing, got Actuation("),
        (rs.Sensing(period=0.05), "0.05 s, must be a multiple of the control period, 0.04 s"),
    ],
    "actuation": [
        ({"lag": 1}, "actuation: expected an Actuation, got {'lag': 1}"),
        (rs.Actuation(velocity=[1, 2]), "actuation: 2 numbers of velocity for 6: "),
    ],
    "record": [
        ("summry", "record must be 'all', 'summary' or every n-th step, got 'summry'"),
        (0, "got 0"),
        (-2, "got -2"),
        (2.5, "got 2.5"),
        (True, "got True"),
        (None, "got None"),
        ([1, 2], "got [1, 2]"),
        (np.array([1, 2]), "record must be"),
        (10**30, "record must be"),
    ],
    "first_run": [
        (-1, "first_run must be a whole number from 0 on, got -1"),
        (0.5, "first_run", "got 0.5"),
        (2**64 - 1, "first_run must be below"),
        ("x", "first_run", "'x'"),
    ],
    "threads": [
        (0, "threads must be a whole number from 1 on, got 0"),
        (-1, "got -1"),
        (1.5, "got 1.5"),
        (True, "got True"),
        ("two", "threads", "'two'"),
        (10**6, "threads must be below"),
    ],
    "chunk": [
        (0, "chunk must be a whole number from 1 on, got 0"),
        (-1, "got -1"),
        (0.5, "got 0.5"),
        (None, "chunk"),
        ("x", "chunk", "'x'"),
    ],
    "progress": [(3, "progress: expected a function", "got 3")],
    "q0": [
        ([0, 0], "q0: expected shape (..., 7), got (2,)"),
        ([NAN] * 7, "q0: nan at index (0,)"),
        ([0] * 7, "q0: the quaternion of 'body' must have length 1"),
        (np.tile(GOAL.q, (2, 2, 1)), "q0: expected shape (7,) or (B, 7), got (2, 2, 7)"),
        (np.empty((0, 7)), "q0: expected shape (7,) or (B, 7), got (0, 7)"),
        ("home", "q0: expected numbers", "'home'"),
        (5, "q0: expected shape (..., 7), got ()"),
        (2 * np.eye(4), "not a rotation"),
        ({"fre": GOAL.q}, "no robot 'fre'", "did you mean 'free'?", "robots: free"),
        ({"free": [1, 2]}, "q0: expected shape (..., 7), got (2,)"),
    ],
}


@pytest.mark.parametrize(
    ("name", "value", "parts"),
    [(name, value, parts) for name, rows in SIMULATE.items() for value, *parts in rows],
    ids=lambda x: x if isinstance(x, str) else None,
)
def test_a_bad_setting_of_simulate_is_an_input_error_that_names_it(name, value, parts):
    with pytest.raises(rs.errors.InputError) as error:
        simulate(**{name: value})
    assert isinstance(error.value, ValueError)
    for part in parts:
        assert part in str(error.value)


@pytest.mark.parametrize(
    ("tolerance", "message"),
    [
        (0, "Points.tolerance must be a positive number, got 0"),
        (NAN, "Points.tolerance: nan"),
        ("small", "Points.tolerance: expected a number, got 'small'"),
    ],
)
def test_a_bad_tolerance_of_a_feature_is_named(tolerance, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.features.Points(tolerance=tolerance)


TASK = {
    "gain": [
        (0, "gain must be a positive number (per second)", "got 0"),
        (-1, "got -1"),
        (NAN, "IBVS.gain: nan; every number must be finite"),
        (INF, "IBVS.gain: inf; every number must be finite"),
        ("fast", "IBVS.gain: no gain 'fast'; gains: adaptive, or a positive number"),
        ([1.0, 2.0], "gain must be a positive number (per second), got [1.0, 2.0]"),
        (None, "IBVS.gain: expected a gain, got None; gains: adaptive, or a positive number"),
    ],
    "tolerance": [(0, "tolerance must be a positive number, got 0"), (NAN, "tolerance: nan")],
    "depth_scale": [
        (0, "depth_scale: expected a factor above zero, or one for each mark, got 0"),
        (-2, "got -2"),
    ],
    "depth": [
        ("tru", "no depth 'tru'; did you mean 'true'? depths: true, goal, filter, or a positive"),
        (0, "IBVS.depth must be a positive number (m), got 0"),
        (NAN, "IBVS.depth: nan"),
        ([1.0, 2.0], "IBVS.depth must be a positive number (m), got [1.0, 2.0]"),
    ],
    "interaction": [
        ("curent", "'curent'", "did you mean 'current'?", "matrices: current, desired, mean"),
        (None, "got None", "matrices: current, desired, mean"),
        (["mean"], "expected numbers of shape (..., k, 6), got ['mean']"),
        (np.eye(3), "interaction: expected shape (..., k, 6), got (3, 3)"),
        (np.ones((7, 6)), "interaction: expected shape (8, 6), a row for each", "got (7, 6)"),
        (rs.laws.Broyden(np.eye(6)), "Broyden start: expected shape (8, 6)", "got (6, 6)"),
    ],
    "law": [
        ("joit", "no law 'joit'", "did you mean 'joint'?", "joint, camera", "command(state)"),
        (rs.laws.JointLaw, "expected a law, not the class, got <class", "joint, camera"),
        (None, "expected a law, got None", "joint, camera"),
        (["joint"], "expected a law, got ['joint']", "joint, camera"),
    ],
    "inverse": [
        (
            "dampd",
            "no inverse 'dampd'",
            "did you mean 'damped'?",
            "inverses: pseudo_inverse, damped",
        ),
        (
            rs.laws.DampedInverse,
            "expected an inverse, not the class, got <class",
            "inverses: pseudo_inverse, damped",
        ),
        (["damped"], "expected an inverse, got ['damped']", "inverses: pseudo_inverse, damped"),
        ({}, "expected an inverse, got {}", "inverses: pseudo_inverse, damped"),
    ],
    "features": [
        (rs.features.Points, "expected a feature, not the class, got <class", "measure(seen)"),
        ("point", "no feature 'point'", "did you mean 'points'?", "polar, "),
        (None, "expected a feature, got None; features: ", "polar, "),
        (Unmeasured(), "expected a feature", "an object with unit, tolerance and measure(seen)"),
    ],
    "camera": [
        ("ey", "no camera 'ey'", "did you mean 'eye'?", "cameras: eye"),
        (3, "camera: expected a name, or two different ones, got 3"),
    ],
    "target": [
        ("dot", "no object 'dot'", "did you mean 'dots'?", "objects: dots"),
        ("eye", "no object 'eye'", "objects: dots"),
        ([1], "IBVS.target must be the name of an object, of 0 to 129"),
    ],
    "belief": [
        (3, "IBVS.belief: expected a Scene, got 3"),
        (rs.Scene(), "the belief has the joints []", "body.x (m)"),
        (two_arms(), "the belief has the joints ['a.link1 (rad)', 'b.link1 (rad)']", "body.qw"),
        (flying(SQUARE[:3]), "the belief has 3 marks on 'dots', the scene 4"),
        (rs.Scene(flying().robots, (), flying().cameras), "belief: no object 'dots'"),
        (rs.Scene(flying().robots, flying().objects), "belief: no camera 'eye'"),
    ],
}


@pytest.mark.parametrize(
    ("name", "value", "parts"),
    [(name, value, parts) for name, rows in TASK.items() for value, *parts in rows],
    ids=lambda x: x if isinstance(x, str) else None,
)
def test_a_bad_part_of_a_task_is_an_input_error_that_names_it(name, value, parts):
    with pytest.raises(rs.errors.InputError) as error:
        simulate(task={name: value})
    assert not isinstance(error.value, rs.errors.GoalError)
    for part in parts:
        assert part in str(error.value)


def test_two_joints_of_one_name_and_different_kinds_are_not_the_same_structure():
    turn = rs.Robot.from_dh([[0, 0, 0, 0]], joints="R", name="lift")
    with pytest.raises(
        rs.errors.InputError, match=r"\['link1 \(rad\)'\], the scene \['link1 \(m\)'\]"
    ):
        rs.simulate(lift(), rs.IBVS(goal=[0.4], belief=lift().replacing(turn)), [0.2])


GOALS = {
    "too short": (GOAL.q[:6], "goal q: expected shape (..., 7), got (6,)"),
    "not finite": ([NAN] * 7, "goal q: nan"),
    "text": ("there", "goal q: expected numbers", "'there'"),
    "quaternion": ([0] * 7, "the quaternion of 'body' must have length 1"),
    "batch": (np.tile(GOAL.q, (2, 1)), "a goal is shown at one q of shape (7,), got (2, 7)"),
    "unknown robot": ({"fre": GOAL.q}, "no robot 'fre'", "did you mean 'free'?"),
    "behind": (BEHIND, "the shown goal puts mark 0 of 'dots' behind camera 'eye'"),
    "out of image": (ASIDE, "the shown goal puts mark 0 of 'dots' out of the image of camera"),
    "computed behind": (
        rs.GoalPose(rs.Pose.at(0, 0, -1)),
        "the computed goal puts mark 0 of 'dots' behind camera 'eye'",
    ),
    "computed out of image": (
        rs.GoalPose(rs.Pose.at(3, 0, 1)),
        "the computed goal puts mark 0 of 'dots' out of the image of camera 'eye'",
    ),
}


@pytest.mark.parametrize("case", GOALS)
def test_a_goal_that_cannot_be_is_a_goal_error(case):
    goal, *parts = GOALS[case]
    with pytest.raises(rs.errors.GoalError) as error:
        simulate(scene=flying(size=(640, 480)), goal=goal)
    assert isinstance(error.value, rs.errors.InputError)
    for part in parts:
        assert part in str(error.value)


def test_a_goal_or_start_outside_the_limits_names_the_joint_and_the_limits():
    limits = r"joint 'link1' of 'lift' is 0.6 m, outside its limits \[0, 0.5\] m"
    with pytest.raises(rs.errors.GoalError, match=f"goal q: {limits}"):
        simulate([0.2], lift(), [0.6])
    with pytest.raises(rs.errors.InputError, match=f"q0: {limits}"):
        simulate([0.6], lift(), [0.2])
    with pytest.raises(rs.errors.InputError, match=r"q0 of row \(1,\): joint 'link1'"):
        simulate([[0.2], [0.6], [0.3]], lift(), [0.2])


def test_an_invalid_scene_or_task_is_reported():
    for scene in (None, "scene", flying().robots[0]):
        with pytest.raises(rs.errors.InputError, match="scene: expected a Scene, got"):
            rs.simulate(scene, rs.IBVS(), START)
    for task in (None, "ibvs", rs.IBVS, flying()):
        with pytest.raises(
            rs.errors.InputError, match=r"task: expected a task such as IBVS\(...\), got"
        ):
            rs.simulate(flying(), task, START)


def test_a_scene_in_which_nothing_can_be_servoed_is_reported():
    still = rs.Scene([], flying().objects, [rs.MountedCamera("eye", rs.Camera(K))])
    with pytest.raises(
        rs.errors.InputError, match="no joint moves camera 'eye' relative to 'dots'"
    ):
        rs.simulate(still, rs.IBVS())
    bare = rs.Scene(flying().robots, [rs.Object("dots", marks=np.empty((0, 3)))], flying().cameras)
    with pytest.raises(rs.errors.InputError, match="object 'dots' has no marks to look at"):
        rs.simulate(bare, rs.IBVS(target="dots"), START)


VALUES = {
    "DH of three columns": (lambda: rs.Robot.from_dh([[0, 0, 1]]), "(..., n, 4), got (1, 3)"),
    "DH flat": (lambda: rs.Robot.from_dh([0, 0, 1, 0]), "got (4,)"),
    "DH of nothing": (lambda: rs.Robot.from_dh(np.empty((0, 4))), "expected shape (n, 4)"),
    "DH ragged": (lambda: rs.Robot.from_dh([[0, 0, 1, 0], [0]]), "theta, d, a, alpha"),
    "DH nan": (lambda: rs.Robot.from_dh([[0, 0, NAN, 0]]), "nan at index (0, 2)"),
    "DH convention": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]], "standart"),
        "must be 'standard' or 'modified', got 'standart'",
    ),
    "DH joints": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]], joints="RX"),
        "joints: expected 1 letters R or P, as in 'R', got 'RX'",
    ),
    "limits crossed": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]], limits=[[1, -1]]),
        "joint limits must be (lowest, highest), got (1.0, -1.0)",
    ),
    "home outside": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]], home=[2], limits=[[-1, 1]]),
        "joint 'link1' of 'robot' is 2 rad, outside its limits [-1, 1] rad",
    ),
    "name": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]], name="../arm"),
        "a name starts with a letter",
    ),
    "q of fk": (lambda: rs.Robot.from_dh([[0, 0, 1, 0]]).fk([0, 0]), "q: expected shape (..., 1)"),
    "link of fk": (
        lambda: rs.Robot.from_dh([[0, 0, 1, 0]]).fk([0], "link2"),
        "no frame 'link2' in robot 'robot'; did you mean 'link1'? frames: base, link1",
    ),
    "robot of the library": (
        lambda: rs.robots.load("rhino"),
        "no robot 'rhino' in the library; did you mean 'rhino_xr4'? robots: car, conveyor",
    ),
    "joint kind": (
        lambda: rs.joints.Joint("revolut"),
        "no joint kind 'revolut'; did you mean 'revolute'?",
    ),
    "scaled rotation": (lambda: rs.Pose(2 * np.eye(4)), "not a rotation: R'R differs"),
    "reflection": (lambda: rs.Pose(np.diag([1, 1, -1, 1])), "not a rotation but a reflection"),
    "last row": (lambda: rs.Pose(np.diag([1, 1, 1, 2])), "the last row of a pose must be 0 0 0 1"),
    "3 x 3 pose": (lambda: rs.Pose(np.eye(3)), "pose: expected shape (..., 4, 4), got (3, 3)"),
    "pose of nan": (lambda: rs.Pose.at(NAN), "position: nan at index (0,)"),
    "quaternion": (lambda: rs.Pose.from_quaternion([0] * 3, [0] * 4), "must have length 1"),
    "frames": (
        lambda: rs.Pose.at(frames=("a", "b")) @ rs.Pose.at(frames=("c", "d")),
        "cannot join a<-b with c<-d: 'b' does not meet 'c'",
    ),
    "focal length zero": (
        lambda: rs.Camera([[0, 0, 320], [0, 800, 240], [0, 0, 1]]),
        "K: focal lengths must be above zero, got 0.0 and 800.0 px",
    ),
    "focal length negative": (
        lambda: rs.Camera([[800, 0, 320], [0, -800, 240], [0, 0, 1]]),
        "got 800.0 and -800.0 px",
    ),
    "K nan": (lambda: rs.Camera([[NAN, 0, 0], [0, 1, 0], [0, 0, 1]]), "K: nan at index (0, 0)"),
    "K shape": (lambda: rs.Camera(np.eye(2)), "K: expected shape (..., 3, 3), got (2, 2)"),
    "K last row": (lambda: rs.Camera(2 * np.eye(3)), "K must be [[fx, skew, cx], [0, fy, cy]"),
    "image of no size": (
        lambda: rs.Camera(K, (0, 480)),
        "image size must be a whole number from 1 to 1000000, got 0",
    ),
    "distortion": (lambda: rs.Camera(K, distortion=(1, 2, 3)), "0, 4 (k1 k2 p1 p2), 5"),
    "chapter": (lambda: rs.Camera.from_chapter(0, 1, 1, 0, 0, 0), "f must be a positive number"),
    "block": (lambda: rs.Block(0, 1, 1), "Block.length must be a positive number (m), got 0"),
    "block with a unit": (lambda: rs.Block("5 cm", 1, 1), "Block.length: expected a number"),
    "wheel": (lambda: rs.Wheel(1, 1, n=2), "Wheel.n must be a whole number from 3 to 4096, got 2"),
    "marks": (lambda: rs.Object("dots", marks=[1, 2, 3]), "marks of 'dots': expected shape"),
    "marks nan": (lambda: rs.Object("dots", marks=[[0, 0, NAN]]), "nan at index (0, 2)"),
    "two of one name": (
        lambda: rs.Scene((), [rs.Object("a"), rs.Object("a")]),
        "two things in the scene are called 'a'; rename one",
    ),
    "frame of a camera": (
        lambda: rs.Scene(lift().robots, (), [rs.MountedCamera("eye", rs.Camera(K), "lift.link2")]),
        "'eye' stands on 'lift.link2', and there is no such frame; did you mean 'lift.link1'?",
    ),
    "frame of a pose": (lambda: lift().pose("lift.lin1"), "did you mean 'lift.link1'? frames:"),
    "points of a view": (lambda: lift().view(points=[1, 2]), "points: expected shape (..., N, 3)"),
    "replacing": (lambda: lift().replacing(rs.Object("x")), "no object 'x' to replace"),
    "truncation": (lambda: rs.laws.PseudoInverse(2), "rcond must be a number above 0 and below 1"),
    "damping": (lambda: rs.laws.DampedInverse(0), "damping must be a positive number, got 0"),
    "length of a law": (
        lambda: rs.laws.CameraLaw(-1),
        "CameraLaw.length must be a positive number",
    ),
    "computed goal": (lambda: rs.GoalPose(2 * np.eye(4)), "not a rotation"),
    "unit": (lambda: rs.units.parse("5 cm", "angle"), "expected one number with a unit of angle"),
    "no unit": (lambda: rs.units.parse("5", "length"), "expected one number with a unit of length"),
    "outcome": (lambda: rs.Outcome("converged"), "in Outcome; did you mean 'CONVERGED'? members"),
    "words of an outcome": (lambda: rs.Outcome("time limit"), "did you mean 'TIME_LIMIT'?"),
    "number of an outcome": (lambda: rs.Outcome(99), "no number 99 in Outcome; members: RUN"),
    "colour": (lambda: rs.Block(1, 1, 1, color="blurple"), "Block.color: no colour 'blurple'; did"),
    "colour of no text": (lambda: rs.Block(1, 1, 1, color=3), "Block.color: no colour 3; colours:"),
    "field": (lambda: EXPERIMENT.with_(duratoin=3), "'duratoin'; did you mean 'duration'? fields:"),
    "no value": (
        lambda: EXPERIMENT.at("task.gain"),
        "task.gain: expected a value, at('task.gain', ",
    ),
    "values twice": (lambda: EXPERIMENT.at({"task.gain": 1}, 2), "{'task.gain': 1} has the values"),
}
EXPERIMENT = rs.load_scenario(rs.examples.path("visp_tutorial"))
PARAMETERS = {  # with the nearest name, of classes with declared fields and others
    "IBVS has no parameter 'gian'; did you mean 'gain'? parameters: goal": lambda: rs.IBVS(gian=1),
    "Sensing has no parameter 'latncy'; did you mean 'latency'? ": lambda: rs.Sensing(latncy=1),
    "Joint has no parameter 'limit'; did you mean 'limits'? ": lambda: rs.joints.Joint(limit=1),
    "Camera has no parameter 'distorion'; did you mean 'dist": lambda: rs.Camera(K, distorion=()),
    "Experiment has no parameter 'duratoin'; did you": lambda: rs.Experiment(None, duratoin=1),
    "Object has no parameter 'mark'; did you mean 'marks'? ": lambda: rs.Object("dots", mark=[]),
}


@pytest.mark.parametrize("message", PARAMETERS)
def test_an_unknown_parameter_is_an_error_with_the_nearest_name(message):
    with pytest.raises(rs.errors.ParameterError) as error:
        PARAMETERS[message]()
    assert str(error.value).startswith(message)
    assert isinstance(error.value, TypeError) and isinstance(error.value, rs.errors.InputError)


def test_an_argument_that_python_refuses_stays_a_type_error():
    with pytest.raises(TypeError, match="missing 1 required keyword-only argument: 'distance'"):
        rs.starts.LookAt()
    with pytest.raises(TypeError, match="positional"):
        rs.IBVS(1, 2, 3, 4, 5, 6)


def test_a_change_in_python_is_not_blamed_on_the_file():
    for name, value in {"task.gain": -1, "task.gian": 1, "cameras.camera.foca": 1}.items():
        with pytest.raises(rs.errors.InputError) as error:
            EXPERIMENT.at(name, value)
        assert type(error.value) is rs.errors.InputError
        assert str(error.value).startswith(f"{name}: ") and "\n" not in str(error.value)
    assert EXPERIMENT.at("task.law", "joint").source == EXPERIMENT.source


def test_a_change_on_the_command_line_is_blamed_on_the_file():
    with pytest.raises(rs.errors.FileError, match=r"visp_tutorial\.toml: task\.gian: unknown key"):
        rs.load_scenario(rs.examples.path("visp_tutorial"), ["task.gian=1"])


@pytest.mark.parametrize("case", VALUES)
def test_a_value_that_cannot_be_is_an_input_error(case):
    call, part = VALUES[case]
    with pytest.raises(rs.errors.InputError) as error:
        call()
    assert part in str(error.value)


def test_the_kinds_of_errors_are_those_that_the_tree_draws():
    with pytest.raises(rs.errors.UnitError):
        rs.units.parse("5", "length")
    with pytest.raises(rs.errors.FrameError):
        lift().pose("nowhere")
    for kind in (
        rs.errors.UnitError,
        rs.errors.FrameError,
        rs.errors.GoalError,
        rs.errors.FileError,
    ):
        assert issubclass(kind, rs.errors.InputError)
    assert issubclass(rs.errors.InputError, rs.RobSimError) and issubclass(
        rs.errors.InputError, ValueError
    )
    assert issubclass(rs.errors.Interrupted, rs.RobSimError)
    assert not issubclass(rs.errors.Interrupted, ValueError)
    assert issubclass(rs.errors.RankWarning, UserWarning)


# ---- files of runs ----


def test_a_run_is_not_saved_where_it_cannot_be(tmp_path):
    run, file = simulate(), tmp_path / "file"
    file.write_text("mine")
    for path in (file / "run.nc", tmp_path, tmp_path / ("x" * 300), "/proc/no/run.nc", "", "a\0b"):
        with pytest.raises(rs.errors.FileError, match="cannot write"):
            rs.save_run(run, path)
    with pytest.raises(rs.errors.FileError, match="cannot write None"):
        rs.save_run(run, None)
    assert file.read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("name", ["run.csv", "run.mcap", "folder/run.nc.zip"])
def test_a_run_is_not_saved_under_the_name_of_another_format(tmp_path, name):
    with pytest.raises(rs.errors.FileError, match=rf"{name}: expected a name that ends in \.nc"):
        rs.save_run(simulate(), tmp_path / name)
    with pytest.raises(rs.errors.FileError, match=r"run\.png: expected .* in \.html or \.htm for"):
        rs.export_html(simulate(), tmp_path / "run.png")
    assert not list(tmp_path.iterdir())
    assert rs.save_run(simulate(), tmp_path / "RUN.NC").exists()


def test_a_run_is_saved_over_another_whole_or_not_at_all(tmp_path):
    path = rs.save_run(simulate(), tmp_path / "run.nc")
    before = path.read_bytes()
    unsavable = simulate().assign_attrs(mine=object())
    with pytest.raises(rs.errors.FileError, match="cannot write"):
        rs.save_run(unsavable, path)
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize("name, value", [("threads", 0), ("chunk", 0), ("progress", 3)])
def test_a_wrong_argument_of_run_is_no_error_of_the_scenario_file(name, value):
    with pytest.raises(rs.errors.InputError, match=f"^{name}") as caught:
        rs.load_scenario(rs.examples.path("chapter_6_1")).run(**{name: value})
    assert type(caught.value) is rs.errors.InputError


def test_the_view_of_a_check_is_true_or_false():
    experiment = rs.load_scenario(rs.examples.path("chapter_6_1"))
    with pytest.raises(rs.errors.InputError, match="view must be True or False, got 3"):
        experiment.check(view=3)


@pytest.mark.full
def test_a_file_that_is_no_run_is_not_opened(tmp_path):
    whole = rs.save_run(simulate(), tmp_path / "run.nc").read_bytes()
    bad = tmp_path / "bad.nc"
    for content in (b"", b"not a run", whole[:100], whole[: len(whole) // 2], whole[:-1]):
        bad.write_bytes(content)
        is_hdf5 = content.startswith(b"\x89HDF")
        told = "has no seal" if is_hdf5 else "is not a NetCDF-4 file"
        with pytest.raises(rs.errors.FileError, match=rf"bad\.nc {told}"):
            rs.open_run(bad)
    simulate().drop_attrs().to_netcdf(bad, engine="h5netcdf")
    with pytest.raises(rs.errors.FileError, match="is not a run that RobSim saved"):
        rs.open_run(bad, unsealed=True)
    for path in (tmp_path / "missing.nc", tmp_path):
        with pytest.raises(rs.errors.FileError, match=r"no such file|this is a folder"):
            rs.open_run(path)
    for path in ("x" * 300, None):
        with pytest.raises(rs.errors.FileError, match="cannot read"):
            rs.open_run(path)


# ---- too much ----


def test_more_than_the_memory_allows_is_refused_with_a_record_that_fits(monkeypatch):
    reports = []
    monkeypatch.setattr("robsim.engine.recorder.get_free_memory", lambda: 4e9)
    starts = np.tile(START.q, (1000, 1))
    words = (
        r"1000 runs with 250001 recorded instants need about (\d+)\.\d GB, and 4\.0 GB are free: "
        r"record every n-th step \(record=(\d+)\) or the end only \(record='summary'\), fewer runs "
    )
    with pytest.raises(rs.errors.InputError, match=words) as refused:
        simulate(starts, duration=10_000.0, progress=reports.append)
    assert reports == []
    need, n = map(int, re.search(words, str(refused.value)).groups())
    assert need / 4.0 <= n <= need / 4.0 + 2
    with pytest.raises(rs.errors.InputError, match="GB are free"):
        simulate(starts, duration=10_000.0, record=n - 1)
    monkeypatch.setattr("robsim.engine.recorder.get_free_memory", lambda: 1e6)
    with pytest.raises(rs.errors.InputError, match=r"0\.0 GB are free: simulate fewer runs$"):
        simulate(np.tile(START.q, (100_000, 1)), record="summary")


PEAK = r"""
import re
import numpy as np, robsim as rs
from robsim.engine import recorder
asked, estimate = [], recorder._estimate_record_bytes
def noted(*arguments):
    asked.append(estimate(*arguments))
    return asked[-1]
recorder._estimate_record_bytes = noted
case = rs.load_scenario(rs.examples.path("stereo_in_hand")).with_(hold=True)
def peak():  # since this process began, unlike ru_maxrss, which is that of its parent, too
    return 1024 * int(re.search(r"VmHWM:\s+(\d+)", open("/proc/self/status").read())[1])
for duration, runs in ((0.2, 1), (0.2, 300), (16.0, 300)):  # compiled before it is measured
    before = peak()
    asked.clear()
    starts = np.repeat(case.start[None], runs, axis=0)
    rs.save_run(case.with_(start=starts, duration=duration).run(), "run.nc")
print(asked[0], peak() - before)
"""


@pytest.mark.full  # as it takes hundreds of megabytes
@pytest.mark.skipif(sys.platform != "linux", reason="what a process took is told otherwise there")
def test_the_memory_that_results_take_until_they_are_saved_is_foreseen(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", PEAK], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    foreseen, taken = map(float, done.stdout.split())
    assert foreseen > 2e8 and 0.2 * foreseen < taken < foreseen


def test_the_same_number_of_runs_is_done_when_less_is_recorded():
    starts = np.tile(turned(10).q, (1000, 1))
    run = simulate(starts, duration=0.4, record="summary")
    assert run.outcome.shape == (1000,) and (run.outcome == Outcome.TIME_LIMIT).all()
    assert "time" not in run.dims


# ---- features and laws of a user ----


def feature(**methods):
    return type("Mine", (Plain,), methods)()


def law(command):
    return type("Mine", (), {"command": command})()


RETURNED = {
    "s without a batch at the goal": (
        {"features": feature(measure=lambda self, seen: seen.points[0].ravel())},
        "Mine: a method returned shape (8,) where (1, k) is needed",
    ),
    "s not finite at the goal": (
        {"features": feature(measure=lambda self, seen: np.full((1, 8), np.nan))},
        "Mine: s at the goal must be finite, got array([nan",
    ),
    "s of no numbers": (
        {"features": feature(measure=lambda self, seen: "far")},
        "Mine: a method returned 'far' where numbers are needed",
    ),
    "L of a flat shape": (
        {"features": feature(interaction=lambda self, seen: np.zeros((len(seen.points), 48)))},
        "a method returned shape (1, 48) where (1, 8, 6) is needed",
    ),
    "L of another k": (
        {"features": feature(interaction=lambda self, seen: np.zeros((1, 6, 6)))},
        "a method returned shape (1, 6, 6) where (1, 8, 6) is needed",
    ),
    "L of nothing": (
        {"features": feature(interaction=lambda self, seen: None)},
        "a method returned shape () where (1, 8, 6) is needed",
    ),
    "a command for five joints": (
        {"law": law(lambda self, state: np.zeros((1, 5)))},
        "Mine.command returned shape (1, 5) where (1, 6) is needed",
    ),
    "a command without a batch": (
        {"law": law(lambda self, state: np.zeros(6))},
        "Mine.command returned shape (6,) where (1, 6) is needed; see robsim.testing",
    ),
    "a command in words": (
        {"law": law(lambda self, state: ["left"] * 6)},
        "Mine.command returned ['left',",
    ),
}


@pytest.mark.parametrize("case", RETURNED)
def test_a_users_feature_or_law_with_an_impossible_result_is_named(case):
    task, words = RETURNED[case]
    with pytest.raises(rs.errors.InputError) as error:
        simulate(task=task)
    assert words in str(error.value)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_shape_that_changes_in_the_middle_of_a_run_is_reported(threads):
    def measure(self, seen):
        s = Plain.measure(self, seen)
        return s[:, :6] if 0.65 < seen.depth[0, 0] < 0.7 else s

    with pytest.raises(
        rs.errors.InputError, match=r"returned shape \(1, 6\) where \(1, 8\) is needed"
    ):
        simulate(np.stack([START.q, turned(0).q]), duration=5, threads=threads, chunk=1,
                 task={"features": feature(measure=measure)})  # fmt: skip


class Oops(Exception):
    """Somebody's own."""


@pytest.mark.parametrize("method", ["measure", "interaction", "command"])
def test_an_exception_of_a_users_code_reaches_the_user_as_it_is(method):
    mistake = Oops("in my own code")

    def fail(self, given):
        raise mistake

    part = {"law": law(fail)} if method == "command" else {"features": feature(**{method: fail})}
    with pytest.raises(Oops) as error:
        simulate(task=part)
    assert error.value is mistake


def test_an_exception_in_one_thread_stops_the_others():
    steps, calls = 200_000, {"good": 0}
    near, far = GOAL.q, (GOAL @ rs.Pose.at(0, 0, -0.2)).q
    both = threading.Barrier(2, timeout=60)
    met = set()

    def command(self, state):
        bad = abs(state.error[0, 0]) > 0.01
        if bad not in met:
            met.add(bad)
            both.wait()  # both chunks have begun
        if bad:
            raise Oops
        calls["good"] += 1
        return 1e-6 * rs.laws.JointLaw().command(state)

    task = {"law": law(command), "tolerance": 1e-12}  # which noise does not let the good one reach
    settings = {"duration": 0.04 * steps, "record": 1000, "sensing": rs.Sensing(noise=0.5)}
    with pytest.raises(Oops):
        simulate([near, far], threads=2, chunk=1, task=task, **settings)
    assert met == {False, True} and 1 <= calls["good"] < steps // 2


def test_a_users_progress_function_may_end_the_run_with_its_own_exception():
    def progress(share):
        raise Oops(share)

    with pytest.raises(Oops):
        simulate(progress=progress)


def test_progress_goes_from_0_to_1():
    shares = []
    simulate(np.tile(START.q, (8, 1)), duration=2, threads=2, chunk=2, progress=shares.append)
    assert shares == sorted(shares) and shares[0] >= 0 and shares[-1] == pytest.approx(1.0)


# ---- too few marks ----


def test_three_marks_on_a_line_are_a_warning_that_names_the_cause():
    line = [[-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0]]
    with pytest.warns(rs.errors.RankWarning) as caught:
        run = simulate(scene=flying(line), duration=2)
    assert len(caught) == 1 and caught[0].filename == __file__
    words = (
        "the features of 'dots' fix only 5 of the 6 motions of camera 'eye' at the goal: its marks "
        "lie on one line; use at least three marks that are not on one line"
    )
    assert words == str(caught[0].message)
    assert np.isfinite(run.q).all()


def test_two_marks_or_one_are_warned_of_and_three_on_a_triangle_are_not():
    with pytest.warns(rs.errors.RankWarning, match="fix only 4 of the 6 motions"):
        simulate(scene=flying(SQUARE[:2]))
    with pytest.warns(rs.errors.RankWarning, match="fix only 2 of the 6 motions"):
        simulate(scene=flying(SQUARE[:1]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(scene=flying(SQUARE[:3]))


# ---- every outcome ----


def blind(low, high):
    """A feature that is not finite while the first mark is between two depths."""

    def measure(self, seen):
        Z = seen.depth[:, :1]
        return np.where((low < Z) & (high > Z), np.nan, Plain.measure(self, seen))

    return feature(measure=measure)


def planar():
    """A planar arm with a camera that looks up; stretched, both joints move it sideways only."""
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="arm")
    eye = rs.MountedCamera("eye", rs.Camera(K), on="arm.link2")
    reach = arm.fk([0.3, -0.6])[:3, 3]
    return rs.Scene([arm], [rs.Object("dot", marks=reach[None] + (0, 0, 1))], [eye])


@dataclass
class Case:
    """A small run; `end` is when it ends, None for somewhere between start and duration."""

    outcome: Outcome
    q0: object
    end: float | None = None
    scene: object = None
    goal: object = GOAL
    task: dict | None = None
    duration: float = 20.0


LOCAL = np.array([[-0.02, 0.05, 0], [0.06, 0.04, 0], [0.1, -0.07, 0], [-0.05, -0.03, 0]])
HALT = law(lambda self, state: np.zeros(state.jacobian.shape[::2]))
CASES = {
    "converged": Case(Outcome.CONVERGED, START),
    "converged at once": Case(Outcome.CONVERGED, GOAL, 0.0),
    "local minimum": Case(
        Outcome.LOCAL_MINIMUM,
        rs.Pose.at(0, 0, -1),
        scene=flying(LOCAL),
        goal=rs.Pose.at(-0.11, -0.24, -0.97, rotvec=(-0.2, 0.2, 1.4)),
        duration=60.0,
    ),
    "a law that does nothing": Case(Outcome.LOCAL_MINIMUM, START, 9 * 0.04, task={"law": HALT}),
    "out of image": Case(
        Outcome.OUT_OF_IMAGE, turned(50), scene=flying(size=(640, 480)), task={"gain": 45.0}
    ),
    "out of image at once": Case(Outcome.OUT_OF_IMAGE, ASIDE, 0.0, flying(size=(640, 480))),
    "behind camera": Case(Outcome.BEHIND_CAMERA, turned(175), task={"interaction": "desired"}),
    "behind camera at once": Case(Outcome.BEHIND_CAMERA, BEHIND, 0.0),
    "joint limit": Case(Outcome.JOINT_LIMIT, [0.2], 0.04, lift(), [0.45], {"gain": 45.0}),
    "singular": Case(Outcome.SINGULAR, [0.0, 0.0], 9 * 0.04, planar(), [0.3, -0.6]),
    "singular mean": Case(Outcome.SINGULAR, turned(180), 9 * 0.04, task={"interaction": "mean"}),
    "diverged": Case(Outcome.DIVERGED, turned(180)),
    "not finite": Case(Outcome.NOT_FINITE, START, task={"features": blind(0.65, 0.7)}),
    "command not finite": Case(
        Outcome.NOT_FINITE,
        START,
        task={"law": law(lambda self, state: rs.laws.JointLaw().command(state) * np.where(
            np.abs(state.error).max(1) < 0.02, np.nan, 1.0)[:, None])},
    ),
    "time limit": Case(Outcome.TIME_LIMIT, START, 1.0, duration=1.0),
}  # fmt: skip


def run_of(case, q0=None, **settings):
    q0 = case.q0 if q0 is None else q0
    return simulate(q0, case.scene, case.goal, case.duration, case.task, **settings)


def assert_ended(run, case):
    """The outcome, its time, and NaN after it and nowhere before."""
    assert outcome(run) == case.outcome
    end = float(run.end_time)
    if case.end is not None:
        assert end == pytest.approx(case.end, abs=1e-12)
    else:
        assert 0 < end < case.duration
    step = round(end / 0.04)
    assert end == step * 0.04
    assert np.isfinite(run.q.values[: step + 1]).all()
    for name, variable in run.data_vars.items():
        if "time" in variable.dims:
            assert np.isnan(variable.values[step + 1 :]).all(), name
    for name in ("s", "pixels", "qd", "error_norm"):
        assert np.isfinite(run[name].values[:step]).all(), name
    np.testing.assert_array_equal(run.q_end, run.q.values[step])
    np.testing.assert_array_equal(run.pixels_end, run.pixels.values[step])
    assert np.isfinite(run.path_length) and (run.path_length > 0) == (step > 0 and has_moved(run))


def has_moved(run):
    return not np.array_equal(run.q0, run.q_end)


@pytest.mark.parametrize("name", CASES)
def test_every_outcome_is_reached_alone_and_in_a_batch_and_nan_comes_after(name):
    case = CASES[name]
    alone = run_of(case)
    assert_ended(alone, case)
    nq = alone.sizes["coordinate"]
    goal = np.asarray(case.goal.q if nq == 7 else case.goal)
    batch = run_of(case, np.stack([alone.q0, goal, alone.q0, alone.q0]), chunk=2, threads=2)
    for i in (0, 2, 3):
        assert_ended(batch.isel(run=i), case)
    assert outcome(batch.isel(run=1)) == Outcome.CONVERGED


def test_all_outcomes_but_running_are_reached():
    assert {case.outcome for case in CASES.values()} == set(Outcome) - {
        Outcome.RUNNING,
        Outcome.ENDED,
        Outcome.UNDETECTED,  # of pictures: tests/pictures/test_detection_in_the_loop.py
        Outcome.NO_GRADIENT,  # tests/pictures/test_direct_servoing.py
        Outcome.NOTHING_IN_VIEW,
        Outcome.UNSTABLE,  # of drives: tests/dynamics/test_drives.py
    }


@pytest.mark.parametrize("kept", [3, "summary"])
def test_the_record_does_not_change_the_end(kept):
    for case in (CASES["diverged"], CASES["behind camera at once"], CASES["joint limit"]):
        whole, part = run_of(case), run_of(case, record=kept)
        for name in ("outcome", "end_time", "path_length", "q_end", "pixels_end", "pixel_error"):
            np.testing.assert_array_equal(part[name], whole[name])


def test_every_outcome_has_a_sentence_for_the_user():
    for each in Outcome:
        words, message = each.name.lower().replace("_", " "), each.message
        assert message.startswith(f"{words}: ") and len(message) > len(words) + 20


# ---- the order of several outcomes at one instant ----


class Jump:
    """A law that moves one joint by `way` in the first period of 40 ms, and gives `then` later."""

    def __init__(self, way, then=0.0, joint=0):
        self.way, self.then, self.joint, self.calls = way, then, joint, 0

    def command(self, state):
        self.calls += 1
        qd = np.zeros(state.jacobian.shape[::2])
        qd[:, self.joint] = self.way / 0.04 if self.calls == 1 else self.then
        return qd


def unsteady():
    """A feature that is not finite once anything has moved; it is measured twice at the goal."""

    class Mine(Plain):
        calls = 0

        def measure(self, seen):
            self.calls += 1
            s = Plain.measure(self, seen) + 0.1 * (self.calls > 2)
            return s if self.calls < 4 else s * np.nan

    return Mine()


@pytest.mark.parametrize(
    ("way", "limit", "features", "expected"),
    [
        (0.1, 4.0, Plain(), Outcome.TIME_LIMIT),
        (0.6, 4.0, Plain(), Outcome.OUT_OF_IMAGE),
        (np.pi, 4.0, Plain(), Outcome.BEHIND_CAMERA),
        (0.6, 0.5, Plain(), Outcome.JOINT_LIMIT),
        (np.pi, 0.5, Plain(), Outcome.JOINT_LIMIT),
        (0.1, 4.0, unsteady, Outcome.NOT_FINITE),
        (0.6, 4.0, unsteady, Outcome.OUT_OF_IMAGE),
        (np.pi, 4.0, unsteady, Outcome.BEHIND_CAMERA),
        (0.6, 0.5, unsteady, Outcome.JOINT_LIMIT),
    ],
)
def test_the_first_of_the_order_is_given_where_several_hold(way, limit, features, expected):
    """JOINT_LIMIT, BEHIND_CAMERA, OUT_OF_IMAGE, a feature that is not finite, TIME_LIMIT."""
    features = features() if callable(features) else features
    task = {"law": Jump(way), "features": features}
    run = simulate([0.05], turret(limit), [0.0], 0.04, task)
    assert outcome(run) == expected and float(run.end_time) == 0.04


def test_behind_the_camera_comes_before_out_of_the_image_whichever_mark_is_which():
    for marks in (((0, 0, 1), (1, 0, 0.5)), ((1, 0, 0.5), (0, 0, 1))):
        scene = turret(marks=marks, size=(2000, 480))
        run = simulate([-1.9], scene, [-0.3])
        seen = scene.view([-1.9], points="dots").visibility
        assert set(seen.tolist()) == {
            rs.vision.Visibility.BEHIND_CAMERA,
            rs.vision.Visibility.OUT_OF_IMAGE,
        }
        assert outcome(run) == Outcome.BEHIND_CAMERA and float(run.end_time) == 0.0


def test_a_state_that_overflows_is_not_finite_before_it_is_a_joint_limit():
    """A command of 1e308 m/s is a number; held for ten seconds it leads nowhere."""
    run = simulate([0.2], lift(), [0.4], dt=10.0, duration=20, task={"law": Jump(0.04e308)})
    assert outcome(run) == Outcome.NOT_FINITE and float(run.end_time) == 10.0


def test_convergence_comes_before_divergence_a_bad_command_and_the_time_limit():
    class Far(Plain):
        """One error of 1 between 0.7 and 50 m, and none elsewhere."""

        def measure(self, seen):
            Z = seen.depth[:, :1]
            return np.where((Z > 0.7) & (Z < 50), 1.0, 0.0)

        def interaction(self, seen):
            return np.tile([[0.0, 0, 1, 0, 0, 0]], (len(seen.depth), 1, 1))

    back = Jump(-100.0, then=NAN, joint=2)
    with pytest.warns(rs.errors.RankWarning):
        run = simulate(START, task={"features": Far(), "law": back}, duration=0.04)
    assert outcome(run) == Outcome.CONVERGED and float(run.end_time) == 0.04


def test_divergence_comes_before_a_bad_command_and_the_time_limit():
    run = simulate(START, task={"law": Jump(-100.0, then=NAN, joint=2)}, duration=0.04)
    assert outcome(run) == Outcome.DIVERGED and float(run.end_time) == 0.04


def test_a_stall_comes_before_the_time_limit():
    run = simulate(START, task={"law": HALT}, duration=9 * 0.04)
    assert outcome(run) == Outcome.LOCAL_MINIMUM
    run = simulate(START, task={"law": HALT}, duration=8 * 0.04)
    assert outcome(run) == Outcome.TIME_LIMIT


# ---- Ctrl-C ----


@pytest.fixture(autouse=True)
def listening():
    """Ctrl-C is heard even if the shell that started us had it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


ENDLESS = {"dt": 0.04, "duration": 400_000.0, "sensing": rs.Sensing(noise=0.5), "record": 100}
TASKS = {"built in": {"tolerance": 1e-12}, "a user's": {"tolerance": 1e-12, "law": Law()}}


def interrupted(q0=START, task="built in", **settings):
    """The error of a run that Ctrl-C stops once something has been done."""

    def stop(share):
        if share > 0:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(rs.errors.Interrupted) as error:
        simulate(q0, task=TASKS[task], **{**ENDLESS, **settings}, progress=stop)
    return error.value


@pytest.mark.covering(1)
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_keeps_the_part_simulated_so_far(task, threads, tmp_path):
    starts = np.stack([START.q, GOAL.q, turned(20).q])
    error = interrupted(starts, task, threads=threads, chunk=2)
    assert str(error) == "stopped by the user; the run so far is in .run"
    run = error.run
    assert (run.outcome == Outcome.RUNNING).all()
    steps = run.sizes["time"]
    assert steps < 100_001  # cut to the simulated part
    for i in range(3):
        done = np.isfinite(run.q.values[i]).all(axis=1)
        count = int(done.sum())
        assert done[:count].all() and count <= steps
        begun = count > 0
        assert np.isfinite(run.q_end[i]).all() == begun == np.isfinite(run.end_time[i])
        for name in ("q", "qd", "s", "pixels", "camera_pose", "error_norm"):
            assert np.isfinite(run[name].values[i, :count]).all(), name
            assert np.isnan(run[name].values[i, count:]).all(), name
    assert np.isfinite(run.q.values[:, 0]).any()
    back = rs.open_run(rs.save_run(run, tmp_path / "run.nc"))
    np.testing.assert_array_equal(back.q, run.q)


def test_the_kept_part_is_the_beginning_of_the_whole_run():
    run = interrupted().run
    count = int(np.isfinite(run.q.values[:, 0]).sum())
    assert count > 10
    whole = simulate(task=TASKS["built in"], **{**ENDLESS, "duration": 40.0})
    assert outcome(whole) == Outcome.TIME_LIMIT
    np.testing.assert_array_equal(run.q.values[:11], whole.q.values[:11])


def test_runs_that_were_over_before_ctrl_c_keep_their_end():
    error = interrupted(np.stack([BEHIND.q, START.q]), threads=1)
    assert error.run.outcome.values.tolist() == [Outcome.BEHIND_CAMERA, Outcome.RUNNING]
    assert error.run.end_time.values[0] == 0.0 and error.run.end_time.values[1] > 0.0


@pytest.mark.full
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there are no timers of signals here")
def test_ctrl_c_reaches_a_run_without_a_progress_function():
    def stop(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    simulate()  # imports and compiles everything before the clock runs
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(rs.errors.Interrupted) as error:
            simulate(task=TASKS["built in"], **ENDLESS)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert outcome(error.value.run) == Outcome.RUNNING


class Interrupting:
    """A law that receives Ctrl-C some times during its third step."""

    def __init__(self, times=1):
        self.steps, self.times, self.thread = 0, times, None

    def command(self, state):
        self.steps, self.thread = self.steps + 1, threading.current_thread()
        for _ in range(self.times if self.steps == 3 else 0):
            signal.raise_signal(signal.SIGINT)
        return -0.1 * state.error[:, :6]


def test_ctrl_c_ends_a_short_run_in_the_calling_thread_after_its_step():
    law = Interrupting()
    with pytest.raises(rs.errors.Interrupted) as error:
        simulate(task={"law": law})
    run = error.value.run
    assert law.thread is threading.main_thread() and law.steps == 3
    assert outcome(run) == Outcome.RUNNING and run.sizes["time"] == 3
    assert np.isfinite(run.q).all() and float(run.end_time) == 2 * 0.04
    whole = simulate(task={"law": Interrupting(times=0)})
    np.testing.assert_array_equal(run.q, whole.q[:3])


def test_a_second_ctrl_c_in_one_step_only_prints_saving(capfd):
    with pytest.raises(rs.errors.Interrupted) as error:
        simulate(task={"law": Interrupting(times=3)})
    assert error.value.run.sizes["time"] == 3
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_another_handler_of_ctrl_c_is_still_called():
    came, law = [], Interrupting(times=0)
    signal.signal(signal.SIGINT, lambda *given: came.append(1))
    whole = simulate(task={"law": law})
    assert law.thread is not threading.main_thread()  # which is to run their function
    assert simulate(task={"law": Interrupting()}).equals(whole) and came == [1]


def test_a_short_run_in_another_thread_is_the_same():
    runs = []
    law = Interrupting(times=0)
    thread = threading.Thread(target=lambda: runs.append(simulate(task={"law": law})))
    thread.start()
    thread.join()
    assert law.thread is thread
    assert runs[0].identical(simulate(task={"law": law}))


def test_a_short_run_warns_as_a_long_one_whatever_the_settings_of_numpy():
    class Rough(Interrupting):
        def command(self, state):
            return super().command(state) + 0.0 * np.log(np.zeros(6)).clip(-1, 1)

    with np.errstate(divide="ignore"), pytest.warns(RuntimeWarning, match="divide by zero"):
        short = simulate(task={"law": Rough(times=0)})
    with np.errstate(divide="raise"), pytest.warns(RuntimeWarning, match="divide by zero"):
        in_pool = simulate(task={"law": Rough(times=0)}, progress=lambda share: None)
    np.testing.assert_array_equal(short.q, in_pool.q)


# ---- what would reach NumPy or Python unchecked ----


WRONG = {
    "gain in a text": lambda: rs.IBVS(gain="2"),
    "dt in a text": lambda: simulate(dt="0.04"),
    "a number beyond floats": lambda: simulate(seed=10**400),
    "q0 ragged": lambda: simulate([[0] * 7, [0]]),
    "q0 of two batches": lambda: two_arms().coordinates({"a": [[0], [0]], "b": [[0], [0], [0]]}),
    "a scene of a number": lambda: rs.Scene(3),
    "an object of numbers": lambda: rs.Object("a", [3]),
    "links of a number": lambda: rs.Robot("a", 3),
    "limits of three": lambda: rs.joints.Joint("revolute", limits=(1, 2, 3)),
    "limits of words": lambda: rs.joints.Joint("revolute", limits=("a", "b")),
    "poses of two batches": lambda: rs.Pose(np.tile(np.eye(4), (2, 1, 1))) @ np.tile(
        np.eye(4), (3, 1, 1)),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_it_is_an_input_error_and_no_other(case):
    with pytest.raises(rs.errors.InputError):
        WRONG[case]()


# ---- views, copies and their remaining content ----


def test_a_law_cannot_write_into_the_loop():
    class Vandal:
        def command(self, state):
            state.error[:] = 0.0
            return np.zeros((len(state.error), 6))

    with pytest.raises(ValueError, match="read-only"):
        simulate(task={"law": Vandal()})


def test_a_goal_is_a_copy():
    q = GOAL.q
    task, same = rs.IBVS(goal=q), rs.IBVS(goal=GOAL.q)
    q[:] = 0.0
    assert task == same
    with pytest.raises(ValueError, match="read-only"):
        task.goal.q[0] = 1.0


def test_collinear_marks_are_reported_for_a_computed_goal_too():
    scene = flying(marks=[[-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0]])
    goal = rs.GoalPose(GOAL.inv())
    with pytest.warns(rs.errors.RankWarning, match="its marks lie on one line"):
        rs.IBVS(goal=goal).bind(scene)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: rs.Robot.from_dh([[0, 0, 1, 0]], home=[[0.0], [1.0]]), "home: expected shape"),
        (lambda: rs.Robot.from_dh([[0, 0, 1, 0]], links=5), "links: expected a list of 1 names"),
        (lambda: rs.units.parse("5 V", "voltage"), "no dimension 'voltage'"),
        (lambda: rs.plot.scene(5), "expected a Scene, got 5"),
        (lambda: rs.Experiment.from_text(5), "expected TOML text, got 5"),
        (lambda: rs.Experiment.from_text("schema = 1", set=5), "5: expected key=value"),
        (lambda: rs.replay(simulate([START.q], duration=0.2).isel(run=[])), "it has no rows"),
        (lambda: simulate(dt=2.0, duration=1.0), "dt 2 s is longer than the duration 1 s"),
        (lambda: rs.Wheel(1, 1, 5000), "from 3 to 4096"),
    ],
)
def test_it_is_refused_in_words(wrong, words):
    with pytest.raises(rs.errors.InputError, match=words):
        wrong()


def test_a_quaternion_as_typed_is_made_exact():
    q = [0, 0, -1, 0.57735, 0.57735, 0.57735, 0]
    T = flying().pose("eye", q).matrix[:3, :3]
    np.testing.assert_allclose(T.T @ T, np.eye(3), atol=1e-14)


def test_limits_of_some_joints_only():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]] * 2, limits=[[-np.inf, np.inf], [-1, 1]])
    np.testing.assert_array_equal(arm.limits, [[-np.inf, np.inf], [-1, 1]])


def test_ctrl_c_while_the_result_is_made_loses_nothing(monkeypatch):
    from robsim.run import simulation_dataset as results

    def disturbed(*given, **named):
        signal.raise_signal(signal.SIGINT)
        made.append(original(*given, **named))
        return made[0]

    made, original = [], results.make_dataset
    monkeypatch.setattr(results, "make_dataset", disturbed)
    with pytest.raises(rs.errors.Interrupted) as error:
        simulate(duration=0.2)
    assert error.value.run is made[0] and np.isfinite(made[0].q).all()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
