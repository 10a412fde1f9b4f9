"""Recorded poses of a robot, their replay by `FollowJoints`, and the files that store them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, RobSimError
from robsim.files import robots
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.run.mission import Mission
from robsim.run.phase import Phase, PhaseName
from robsim.servo.tasks.follow_joints import FollowJoints
from robsim.servo.tasks.joint_names import index_joints
from robsim.studio.pendant.coordinate_fields import (
    FILE_ROUNDING,
    CoordinateField,
    list_coordinate_fields,
)
from robsim.studio.python_code import format_python_code
from robsim.trajectory import Trapezoid
from robsim.world.scene import Scene

FULL_SPEED = {"deg": 60.0, "cm": 25.0}  # per second, of a joint whose robot file has no speed
FILE_UNITS = {"deg": "deg", "cm": "m"}  # unit of goals in files, by displayed unit
RAMP = 0.5  # seconds from rest to full speed
RUN_DURATION = 10.0  # seconds, the duration of an experiment that does not give one
MOST_POSES = 200
PaceArguments = dict[str, Any]  # of `FollowJoints`: a number, or one for each axis
NAME = PhaseName()


@dataclass(frozen=True, eq=False)
class RecordedPose:
    """A recorded configuration (nq,) in rad and m, with a name."""

    name: str
    q: Array


class ReplayPace(NamedTuple):
    """Pace of a replay: a share of the full speed of the joints, or a duration of each leg in s."""

    speed: float = 0.5
    duration: float | None = None


def check_pose_name(name: object, others: list[str]) -> str:
    """Return the name of a pose; raise InputError if it is not usable or taken."""
    text = name.strip() if isinstance(name, str) else name
    checked = str(NAME.check(text, "name of a pose"))
    if checked in others:
        raise InputError(f"another pose is called '{checked}'")
    return checked


def find_followed_coordinates(robot: Robot) -> NDArray[np.int64]:
    """Return the indices of the coordinates that `FollowJoints` moves."""
    joints = index_joints(Scene((robot,))).values()
    return np.array([joint.coordinate for joint in joints], dtype=np.int64)


def build_replay(robot: Robot, poses: list[RecordedPose], pace: ReplayPace) -> Experiment[Mission]:
    """Return the experiment that drives a robot from home through recorded poses, one by one.

    Raise InputError if there is no pose, or if the poses differ in coordinates that `FollowJoints`
    cannot move, such as the pose of a vehicle.
    """
    if not poses:
        raise InputError("no pose is recorded yet")
    followed = find_followed_coordinates(robot)
    start = _place_base(robot, poses, followed)
    task = _describe_pace(robot, followed, pace)
    phases = [Phase(pose.name, FollowJoints(to=pose.q[followed], **task)) for pose in poses]
    longest = float(compute_leg_durations(robot, poses, pace).max())
    return Experiment(
        Scene((robot,)),
        Mission(phases),
        None if np.array_equal(start, robot.home) else start,
        duration=max(RUN_DURATION, math.ceil(1.1 * longest) + 1.0),
        title=f"{robot.name}: {len(poses)} taught {'pose' if len(poses) == 1 else 'poses'}",
    )


def _place_base(robot: Robot, poses: list[RecordedPose], followed: NDArray[np.int64]) -> Array:
    """Return home, with the coordinates that cannot be followed as in all poses."""
    fixed = np.setdiff1d(np.arange(robot.nq), followed)
    if not followed.size:
        raise InputError(
            f"no joint of '{robot.name}' can be replayed: FollowJoints moves joints of one "
            "coordinate, not vehicles or free bodies"
        )
    start = np.array(robot.home)
    start[fixed] = poses[0].q[fixed]
    for pose in poses:
        moved = fixed[np.abs(pose.q[fixed] - start[fixed]) > 0]
        if moved.size:
            names = ", ".join(robot.coordinate_names[i] for i in moved)
            raise InputError(
                f"'{pose.name}' differs from '{poses[0].name}' in {names}, which FollowJoints "
                "cannot move: record both with the same values"
            )
    return start


def _describe_pace(robot: Robot, followed: NDArray[np.int64], pace: ReplayPace) -> PaceArguments:
    """Return the arguments of `FollowJoints` that set the pace."""
    if pace.duration is not None:
        return {"duration": pace.duration}
    fields = [list_coordinate_fields(robot)[i] for i in followed]
    drives = _list_drive_speeds(robot)
    full = [
        drives[field.name] / field.size if field.name in drives else FULL_SPEED[field.unit]
        for field in fields
    ]
    speeds = [max(math.floor(10.0 * pace.speed * each + 1e-9) / 10.0, 0.1) for each in full]
    speed = [x * field.size for x, field in zip(speeds, fields, strict=True)]
    ramp = [round(x / RAMP, 1) * f.size for x, f in zip(speeds, fields, strict=True)]
    same = len(set(speed)) == 1 and len({field.unit for field in fields}) == 1
    if same:
        return {"speed": speed[0], "acceleration": ramp[0]}
    return {"speed": tuple(speed), "acceleration": tuple(ramp)}


def _list_drive_speeds(robot: Robot) -> dict[str, float]:
    """Return the largest speed of each joint whose robot file gives one, in rad/s or m/s."""
    return {
        link.joint.name or link.name: link.joint.speed
        for link in robot.links
        if link.joint.speed is not None
    }


def compute_leg_durations(robot: Robot, poses: list[RecordedPose], pace: ReplayPace) -> Array:
    """Return the duration of each leg of a replay in seconds."""
    if pace.duration is not None:
        return np.full(len(poses), pace.duration)
    followed = find_followed_coordinates(robot)
    q = np.array([robot.home, *(pose.q for pose in poses)])[:, followed]
    task = _describe_pace(robot, followed, pace)
    return np.asarray(Trapezoid(q[:-1], q[1:], **task).duration)


def format_replay_code(robot: Robot, poses: list[RecordedPose], pace: ReplayPace) -> str:
    """Return Python code that builds and runs the replay, with its numbers in degrees and cm.

    A robot that is neither in the library nor in an unchanged URDF file is stored as text.
    """
    experiment = build_replay(robot, poses, pace)
    loading = _format_robot_loading(robot)
    if not loading or experiment.start is not None:
        return format_python_code(experiment)
    followed = find_followed_coordinates(robot)
    fields = [list_coordinate_fields(robot)[i] for i in followed]
    return "\n".join(
        [
            *_format_imports(fields),
            "",
            f"robot = {loading}",
            f"poses = {{  # {', '.join(field.name for field in fields)}",
            *(f"    {_quote(p.name)}: {_format_row(p.q[followed], fields)}," for p in poses),
            "}",
            "legs = [",
            f"    rs.Phase(name, rs.FollowJoints(to={_format_goal(fields)}, "
            f"{_format_pace(experiment.task.phases[0].task, fields)}))",
            "    for name, q in poses.items()",
            "]",
            "experiment = rs.Experiment(",
            f"    rs.Scene(robot), rs.Mission(legs), {_format_settings(experiment)}",
            ")",
            "run = experiment.run()",
            "print(run)",
            "rs.show(run)",
            "",
        ]
    )


def _format_imports(fields: list[CoordinateField]) -> list[str]:
    """Return the import statements."""
    names = sorted({FILE_UNITS[f.unit] for f in fields} | {f.unit for f in fields})
    return [
        "import numpy as np",
        "",
        "import robsim as rs",
        f"from robsim.units import {', '.join(names)}",
    ]


def _format_goal(fields: list[CoordinateField]) -> str:
    """Return the expression of a goal in rad and m, from `q` in the displayed units."""
    units = [FILE_UNITS[field.unit] for field in fields]
    scale = units[0] if len(set(units)) == 1 else f"np.array([{', '.join(units)}])"
    return f"np.array(q) * {scale}"


def _format_pace(task: Any, fields: list[CoordinateField]) -> str:
    """Return the arguments of `FollowJoints` that set the pace."""
    if task.duration is not None:
        return f"duration={task.duration:g}"
    parts = []
    for name in ("speed", "acceleration"):
        value = getattr(task, name)
        if isinstance(value, tuple):
            numbers = [f"{x / f.size:.6g} * {f.unit}" for x, f in zip(value, fields, strict=True)]
            parts.append(f"{name}=[{', '.join(numbers)}]")
        else:
            parts.append(f"{name}={value / fields[0].size:.6g} * {fields[0].unit}")
    return ", ".join(parts)


def _format_settings(experiment: Experiment[Mission]) -> str:
    """Return the further arguments of the experiment."""
    title = f"title={_quote(experiment.title or '')}"
    own = experiment.duration != RUN_DURATION
    return f"duration={experiment.duration:g}, {title}" if own else title


def _format_row(q: Array, fields: list[CoordinateField]) -> str:
    """Return coordinates as a list in the displayed units."""
    numbers = (
        round(float(x) / FILE_ROUNDING[f.unit][0], 9) + 0.0 for x, f in zip(q, fields, strict=True)
    )
    return f"[{', '.join(f'{x:.9g}' for x in numbers)}]"


def _quote(text: str) -> str:
    """Return a text as a Python literal in double quotes."""
    literal = repr(text)
    return f'"{literal[1:-1]}"' if literal[0] == "'" and '"' not in text else literal


def _format_robot_loading(robot: Robot) -> str:
    """Return the expression that loads a robot, or "" if no expression gives the same robot."""
    origin = robot.origin
    try:
        if origin is not None and origin.urdf is not None:
            read = Robot.from_urdf(origin.urdf)
            same = read == robot
            return f"rs.Robot.from_urdf({_quote(str(Path(origin.urdf)))})" if same else ""
        if origin is not None and origin.model is not None and robots.load(origin.model) == robot:
            return f"rs.robots.{origin.model}()"
    except (RobSimError, OSError):
        pass
    return ""
