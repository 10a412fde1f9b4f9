"""Robots from elsewhere: from the library by `model`, from a URDF file by `urdf`."""

from __future__ import annotations

import os
from pathlib import Path

from robsim.base.errors import FileError, FrameError, InputError, said
from robsim.declare.problems import Problems, under
from robsim.declare.spec import Context, Unsayable
from robsim.files import robots
from robsim.files.toml import Tables, parse, read_text
from robsim.robot.origin import Origin
from robsim.robot.robot import Robot
from robsim.robot.robot_table import ROBOT


def origin_robot(table: Tables, folder: Path) -> Robot:
    """Return the robot that `model` or `urdf` in a table names; a path is relative to `folder`.

    InputError: there is none, or its file cannot be read.
    """
    key = "model" if "model" in table else "urdf"
    given = table[key]
    if not isinstance(given, str) or not given:
        wanted = (
            "the name of a robot of the library" if key == "model" else "the path of a URDF file"
        )
        with under(key):
            raise InputError(f"must be {wanted}, got {said(given)}")
    if key == "model":
        with under(key):
            return robots.load(given)
    try:
        return Robot.from_urdf(folder / given, tip=table.get("tip"))
    except (FrameError, FileError) as error:
        with under("tip" if isinstance(error, FrameError) else "urdf"):
            raise InputError(str(error)) from None


def read_origin(robot: Robot, folder: Path) -> tuple[Tables, Robot]:
    """Return the keys that name the origin of a robot in a file of a folder, and it as it is there.

    A robot that was read from a complete text may be that of the library with its name.
    Unsayable: there is no origin, or it cannot be read any more.
    """
    origin = robot.origin or Origin(robot.name)
    if origin.urdf is None:
        if origin.model not in robots.names():
            raise Unsayable
        return {"model": origin.model}, robots.load(str(origin.model))
    path = Path(origin.urdf)
    inside = path.is_relative_to(folder.absolute())
    named = path.relative_to(folder.absolute()).as_posix() if inside else path.as_posix()
    try:
        plain = Robot.from_urdf(path, tip=robot.tip)
    except (InputError, OSError):
        raise Unsayable from None
    return {"urdf": named, "name": robot.name, "tip": robot.tip}, plain


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """Return the robot of a file. FileError: it cannot be read, or says what cannot be.

    >>> from robsim import robots
    >>> read_robot(robots.file("planar_2r")).nq
    2
    """
    problems = Problems(str(path))
    made = Context(problems).tried(ROBOT, parse(read_text(path), str(path)))
    problems.stop()
    robot: Robot = made
    return robot
