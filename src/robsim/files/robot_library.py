"""Robots by reference: from the library by `model`, from a URDF file by `urdf`."""

from __future__ import annotations

import os
from pathlib import Path

from robsim.base.errors import FileError, FrameError, InputError, format_value
from robsim.base.file_content import format_relative_path
from robsim.declare.context import Context, UnwritableChange
from robsim.declare.problems import Problems, prefix_path
from robsim.files import robots
from robsim.files.toml import Tables, parse_toml, read_toml_text
from robsim.robot.robot import Robot
from robsim.robot.robot_origin import RobotOrigin
from robsim.robot.robot_table import ROBOT


def load_origin_robot(table: Tables, folder: Path) -> Robot:
    """Return the robot that `model` or `urdf` in a table refers to.

    Paths are relative to `folder`. Raise InputError if the robot does not exist, or if its file
    cannot be read.
    """
    key = "model" if "model" in table else "urdf"
    reference = table[key]
    if not isinstance(reference, str) or not reference:
        expected_text = (
            "the name of a robot of the library" if key == "model" else "the path of a URDF file"
        )
        with prefix_path(key):
            raise InputError(f"must be {expected_text}, got {format_value(reference)}")
    if key == "model":
        with prefix_path(key):
            return robots.load(reference)
    try:
        return Robot.from_urdf(folder / reference, tip=table.get("tip"))
    except (FrameError, FileError) as error:
        with prefix_path("tip" if isinstance(error, FrameError) else "urdf"):
            raise InputError(str(error)) from None


def describe_origin(robot: Robot, folder: Path) -> tuple[Tables, Robot]:
    """Return the keys of a reference to the origin of a robot, and the robot of that origin.

    A robot from a complete text refers to the library robot of its name. Raise UnwritableChange
    if there is no origin, or if it cannot be read.
    """
    origin = robot.origin or RobotOrigin(robot.name)
    if origin.urdf is None:
        if origin.model not in robots.names():
            raise UnwritableChange
        return {"model": origin.model}, robots.load(str(origin.model))
    path = Path(origin.urdf)
    reference = format_relative_path(path, folder)
    try:
        plain = Robot.from_urdf(path, tip=robot.tip)
    except (InputError, OSError):
        raise UnwritableChange from None
    return {"urdf": reference, "name": robot.name, "tip": robot.tip}, plain


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """Return the robot of a TOML file; FileError if it cannot be read or is not valid.

    >>> from robsim import robots
    >>> read_robot(robots.file("planar_2r")).nq
    2
    """
    problems = Problems(str(path))
    value = ROBOT.read_or_report(parse_toml(read_toml_text(path), str(path)), Context(problems))
    problems.stop()
    robot: Robot = value
    return robot
