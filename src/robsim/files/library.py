"""Robots from elsewhere: from the library by `model`, from a URDF file by `urdf`."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import Any

from robsim.base.errors import FileError, FrameError, InputError, said
from robsim.declare.lists import label, references
from robsim.declare.problems import Problems, under
from robsim.declare.spec import UNREADABLE, Context, Live, Unsayable
from robsim.declare.tables import merge_table, write_table
from robsim.files import robots
from robsim.files.toml import Tables, parse, read_text
from robsim.robot.origin import Origin
from robsim.robot.robot import Robot
from robsim.robot.robot_table import MOST, ROBOT, RobotTable


def expanded(tables: Any, problems: Problems, folder: Path, *path: str | int) -> Any:
    """Return a list of robots in which `model` and `urdf` are replaced by the robots' own tables.

    What else a table says comes over them; without a name the robot keeps its own. The path of a
    URDF file is relative to `folder`. A robot that is not found is a problem, and UNREADABLE.
    """
    if not isinstance(tables, list) or len(tables) > MOST:  # which is refused where it is read
        return tables
    made = [UNREADABLE] * len(tables)
    for i, table in enumerate(tables):
        name = table.get("name", i) if isinstance(table, dict) else i
        with problems.at(*path, name if isinstance(name, str) else i):
            made[i] = _expanded(table, folder)
    return made


def _expanded(table: Any, folder: Path) -> Any:
    tools = table.get("tools") if isinstance(table, dict) else None
    if isinstance(tools, list) and len(tools) <= MOST:
        table = {**table, "tools": [_tool(tool, i, folder) for i, tool in enumerate(tools)]}
    given = references(table) if isinstance(table, dict) else set()
    if not given:
        return table
    if len(given) > 1:
        raise InputError("model and urdf: give one of the two only")
    rest = {key: part for key, part in table.items() if key not in ("model", "urdf")}
    if "model" in given:
        with under("model"):
            own = {**_library_tables(table["model"]), "model": Live(Origin(table["model"]))}
    else:
        own = _urdf_tables(table, folder)
        own["urdf"] = Live(Origin(urdf=os.path.abspath(folder / table["urdf"])))
    return merge_table(RobotTable, own, rest, False)


def _tool(table: Any, number: int, folder: Path) -> Any:
    with under("tools", label(table, number)):
        return _expanded(table, folder)


def _library_tables(name: Any) -> Tables:
    if not isinstance(name, str):
        raise InputError(f"must be the name of a robot of the library, got {said(name)}")
    return _parsed(name)


@cache
def _parsed(name: str) -> Tables:
    path = robots.file(name)
    return parse(read_text(path), str(path))


def _urdf_tables(table: Tables, folder: Path) -> Tables:
    """Return the robot of a URDF file link by link, with the tip that the table names."""
    path = table["urdf"]
    if not isinstance(path, str) or not path:
        with under("urdf"):
            raise InputError(f"must be the path of a URDF file, got {said(path)}")
    try:
        robot = Robot.from_urdf(folder / path, tip=table.get("tip"))
    except (FrameError, FileError) as error:
        with under("tip" if isinstance(error, FrameError) else "urdf"):
            raise InputError(str(error)) from None
    made = write_table(robot, Context(Problems("urdf")), RobotTable)
    del made["on"]  # where it stands, or on which link as a tool, is not for the file to say
    return made


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
