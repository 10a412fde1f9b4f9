"""Files of the robot library: one robot each, in the form that scenarios have for robots."""

from __future__ import annotations

import os

from robsim.robot.robot import Robot
from robsim.scenario import build
from robsim.scenario.problems import Problems
from robsim.scenario.schema import RobotFile
from robsim.scenario.tables import checked
from robsim.scenario.text import parse, read_text


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """The robot of a file. FileError: the file cannot be read, or says what cannot be.

    >>> from robsim.files import robots
    >>> read_robot(robots.file("planar_2r")).nq
    2
    """
    source = str(path)
    problems = Problems(source)
    table = checked(RobotFile, parse(read_text(path), source), problems)
    made = None
    with problems.at():
        made = build.robot(table)
    return problems.settled(made)
