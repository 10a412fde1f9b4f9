"""Scenario files of tasks that follow trajectories: the meaning of each key, and refusals."""

import numpy as np
import pytest
from click.testing import CliRunner

import robsim as rs
from robsim.cli.commands import cli
from robsim.run.experiment import Experiment
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

DEG = np.pi / 180
CRANE = """
schema = 1
[[robots]]
name = "crane"
links = [
    { name = "base" },
    { name = "lift", joint = "prismatic", limits = ["0 cm", "80 cm"] },
    { name = "slew", joint = "revolute", place = { position = "0, 0, 1 m" } },
    { name = "hook", joint = "revolute", place = { position = "1, 0, 0 m" } },
]
[task]
"""


def task_of(text):
    return Experiment.from_text(CRANE + text).task


MEANT = {
    'kind = "follow_joints"\nto = { lift = "5 cm", "crane.slew" = "90 deg" }\n'
    'duration = "1500 ms"': (rs.FollowJoints({"lift": 0.05, "crane.slew": 90 * DEG}, duration=1.5)),
    'kind = "follow_joints"\nto = ["10 mm", "30 deg", "1 rad"]\nspeed = ["5 cm/s", "1 rad/s", '
    '"60 deg/s"]\nacceleration = "2 rad/s^2"\ngain = 3\ntolerance = 1e-4': (
        rs.FollowJoints(
            [0.01, 30 * DEG, 1.0],
            speed=[0.05, 1.0, 60 * DEG],
            acceleration=2.0,
            gain=3,
            tolerance=1e-4,
        )
    ),
    'kind = "follow_joints"\nby = { slew = "-90 deg", lift = "5 cm" }\nduration = "1 s"': (
        rs.FollowJoints(by={"slew": -90 * DEG, "lift": 0.05}, duration=1.0)
    ),
    'kind = "follow_joints"\njoints = ["hook", "lift"]\ntrajectory = { kind = "quintic", '
    'start = ["0 deg", "0 m"], end = ["90 deg", "5 cm"], duration = "2 s" }': (
        rs.FollowJoints(trajectory=Quintic([0, 0], [90 * DEG, 0.05], 2.0), joints=["hook", "lift"])
    ),
    'kind = "follow_joints"\njoints = "lift"\ntrajectory = { kind = "trapezoid", '
    'start = ["0 m"], end = ["5 cm"], speed = "10 cm/s", acceleration = ["1 m/s^2"] }': (
        rs.FollowJoints(
            trajectory=Trapezoid([0], [0.05], speed=0.1, acceleration=[1.0]), joints="lift"
        )
    ),
    'kind = "follow_joints"\njoints = ["lift", "hook"]\ntrajectory = { kind = "blends", '
    'points = [["0 m", "0 rad"], ["5 cm", "1 rad"], ["1 cm", "1 rad"]], speed = "1 rad/s", '
    'acceleration = "2 m/s^2", corner = ["1 mm", "1 deg"] }': (
        rs.FollowJoints(
            trajectory=Blends(
                [[0, 0], [0.05, 1], [0.01, 1]], speed=1.0, acceleration=2.0, corner=[0.001, DEG]
            ),
            joints=["lift", "hook"],
        )
    ),
    'kind = "follow_path"\nto = { position = "1, 0, 2 m", rpy = "0, 0, 90 deg" }\nduration = "2 s"'
    '\nframe = "crane.hook"\ninverse = "damped"\ndamping = 0.1\njoints = ["lift", "slew"]': (
        rs.FollowPath(
            rs.Pose.at(1, 0, 2, rpy=(0, 0, 90 * DEG)),
            duration=2.0,
            frame="crane.hook",
            inverse=rs.laws.DampedInverse(0.1),
            joints=["lift", "slew"],
        )
    ),
    'kind = "follow_path"\nto = { position = "1, 0, 2 m" }\nmask = "position"\n'
    'speed = "10 cm/s"\nacceleration = "1 m/s^2"\nrcond = 1e-4\ngain = 2': (
        rs.FollowPath(
            [1, 0, 2],
            mask="position",
            speed=0.1,
            acceleration=1.0,
            inverse=rs.laws.PseudoInverse(1e-4),
            gain=2,
        )
    ),
    'kind = "follow_path"\npath = { start = { position = "1, 0, 1 m" }, end = '
    '{ position = "1, 0, 2 m" }, speed = "10 cm/s", acceleration = "1 m/s^2", '
    'turn = "90 deg/s", turn_acceleration = "1 rad/s^2" }\nlimit = { joint = "1 rad/s" }\n'
    'secondary = { kind = "posture", q = ["10 cm", "0 deg", "0 deg"] }': (
        rs.FollowPath(
            path=Straight(
                rs.Pose.at(1, 0, 1),
                rs.Pose.at(1, 0, 2),
                speed=0.1,
                acceleration=1.0,
                turn=90 * DEG,
                turn_acceleration=1.0,
            ),
            limit=rs.laws.SpeedLimit(joint=1.0),
            secondary=rs.laws.Posture([0.1, 0, 0]),
        )
    ),
    'kind = "follow_path"\npath = [{ start = { position = "1, 0, 1 m" }, end = { position = '
    '"1, 0, 2 m" }, duration = "1 s" }, { start = { position = "1, 0, 2 m" }, end = '
    '{ position = "1, 1, 2 m" }, duration = "2 s" }]': (
        rs.FollowPath(
            path=Path(
                [
                    Straight(rs.Pose.at(1, 0, 1), rs.Pose.at(1, 0, 2), 1.0),
                    Straight(rs.Pose.at(1, 0, 2), rs.Pose.at(1, 1, 2), 2.0),
                ]
            )
        )
    ),
}


@pytest.mark.parametrize("text", MEANT)
def test_a_table_means_its_task(text):
    assert task_of(text) == MEANT[text]


JOINTS = 'kind = "follow_joints"\n'
PATH = 'kind = "follow_path"\n'
TO = 'to = { position = "1, 0, 2 m" }\n'


@pytest.mark.parametrize(
    "text,words",
    [
        (JOINTS + 'duration = "1 s"', ["task", "give one of to="]),
        (JOINTS + 'to = { lift = "5 cm" }', ["task", "give either duration, or speed"]),
        (JOINTS + 'to = { lft = "5 cm" }\nduration = "1 s"', ["no joint 'lft'", "mean 'lift'"]),
        (JOINTS + 'to = { lift = "5 deg" }\nduration = "1 s"', ["task.to.lift", "length", "m, cm"]),
        (JOINTS + 'to = { lift = 5 }\nduration = "1 s"', ["task.to.lift", "unit"]),
        (JOINTS + 'to = { lift = [5] }\nduration = "1 s"', ["task.to.lift", "text with a unit"]),
        (JOINTS + 'by = { lft = "5 cm" }\nduration = "1 s"', ["by: no joint 'lft'", "mean 'lift'"]),
        (JOINTS + 'by = { lift = "5 deg" }\nduration = "1 s"', ["task.by.lift", "length", "m, cm"]),
        (
            JOINTS + 'by = { lift = "5 cm", slew = "1 rad" }\nto = { lift = "5 cm" }',
            ["task: to and by: give one of them"],
        ),
        (JOINTS + 'to = {}\nduration = "1 s"', ["task.to", "at least 1"]),
        (
            JOINTS + 'to = ["5 cm"]\nduration = "1 s"',
            ["task.to", "1 coordinates, expected 3: lift"],
        ),
        (JOINTS + 'to = "5 cm"\nduration = "1 s"', ["task.to"]),
        (JOINTS + 'to = { lift = "5 cm" }\nduration = 1', ["task.duration", "unit of time"]),
        (JOINTS + 'to = { lift = "5 cm" }\nduration = "-1 s"', ["task.duration", "greater than 0"]),
        (
            JOINTS + 'to = { lift = "5 cm" }\nspeed = "0 m/s"\nacceleration = "1 m/s^2"',
            ["task.speed", "must be greater than 0"],
        ),
        (
            JOINTS + 'to = { lift = "5 cm" }\nspeed = "1 s"\nacceleration = "1 m/s^2"',
            ["task.speed", "expected one number with a unit of speed"],
        ),
        (
            JOINTS + 'to = { lift = "5 cm" }\nspeed = ["1 m/s", "1 m/s"]\nacceleration = "1 m/s^2"',
            ["task.speed", "2 velocities, expected 1"],
        ),
        (
            JOINTS + 'joints = "lift"\ntrajectory = { kind = "spline" }',
            ["task.trajectory.kind", "'spline'", "quintic"],
        ),
        (
            JOINTS + 'joints = "lift"\ntrajectory = { kind = "quintic", start = ["0 m"], '
            'end = ["1 deg"], duration = "1 s" }',
            ["task.trajectory.end[0]", "length"],
        ),
        (
            JOINTS + 'joints = "lift"\ntrajectory = { kind = "blends", points = [["0 m"], ["0 m"]],'
            ' speed = "1 m/s", acceleration = "1 m/s^2" }',
            ["task.trajectory", "number 0 and 1 are the same"],
        ),
        (
            JOINTS + 'joints = "lift"\ntrajectory = { kind = "trapezoid", start = ["0 m"], '
            'end = ["1 m"] }',
            ["task.trajectory.speed", "missing"],
        ),
        (JOINTS + 'joints = "boom"\nto = ["5 cm"]\nduration = "1 s"', ["no joint 'boom'"]),
        (JOINTS + 'camera = "eye"', ["task.camera", "unknown key"]),
        (PATH + 'duration = "1 s"', ["task", "give either to=a pose"]),
        (PATH + TO + 'speed = "1 m/s"\nacceleration = "1 m/s^2"', ["turn and turn_acceleration"]),
        (PATH + TO + 'duration = "1 s"\nmask = "turn"', ["task.mask", "'pose'"]),
        (PATH + TO + 'duration = "1 s"\nrcond = 2', ["task.rcond"]),
        (PATH + TO + 'duration = "1 s"\ndamping = 1', ["damping is for inverse"]),
        (PATH + TO + 'duration = "1 s"\ninverse = "transpose"', ["task.inverse"]),
        (PATH + 'to = { rpy = "0, 0, 1 rad" }\nmask = "position"\nduration = "1 s"', ["task.to"]),
        (PATH + 'to = { x = 1 }\nduration = "1 s"', ["task.to.x", "unknown key"]),
        (PATH + "path = []", ["task.path", "at least 1"]),
        (PATH + 'path = { duration = "1 s" }', ["task.path.start", "missing"]),
        (
            PATH + 'path = { start = {}, end = {}, speed = "1 m/s" }',
            ["task.path", "speed and acceleration: give both"],
        ),
        (
            PATH + TO + 'duration = "1 s"\nlimit = { joint = ["1 m/s"] }',
            ["task.limit.joint", "expected 3"],
        ),
    ],
)
def test_each_fault_is_one_clear_error(text, words):
    with pytest.raises(rs.errors.FileError) as error:
        task_of(text)
    message = str(error.value)
    assert all(word in message for word in words), message
    assert len(message) < 1000


@pytest.mark.parametrize(
    "text,words",
    [
        (PATH + TO + 'duration = "1 s"\nframe = "crane.hok"', ["'crane.hok'", "mean 'crane.hook'"]),
        (JOINTS + 'to = { lift = "5 m" }\nduration = "1 s"', ["'lift' is to go to 5 m, outside"]),
    ],
)
def test_a_check_finds_these_faults(text, words):
    with pytest.raises(rs.errors.FileError) as error:
        Experiment.from_text(CRANE + text).check()
    assert all(word in str(error.value) for word in words), str(error.value)


def test_a_file_is_run_checked_and_drawn_from_the_command_line(tmp_path):
    file = tmp_path / "crane.toml"
    text = JOINTS + 'to = { lift = "5 cm", slew = "90 deg" }\nduration = "1 s"\n'
    file.write_text(CRANE + text + '[run]\nduration = "2 s"\n')
    checked = CliRunner().invoke(cli, ["check", str(file)])
    assert checked.exit_code == 0, checked.output
    done = CliRunner().invoke(cli, ["run", str(file), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "converged" in done.output and "px" not in done.output
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"run.nc", "scene.png", "velocity.png"} <= names and "image.png" not in names
    run = rs.open_run(tmp_path / "out" / "run.nc")
    np.testing.assert_allclose(run.q_end, [0.05, np.pi / 2, 0.0], atol=1e-12)
