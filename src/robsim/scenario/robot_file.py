"""Files of the robot library: one robot each, in the form that scenarios have for robots."""

from __future__ import annotations

import os
from pathlib import Path

from robsim.robot import Robot
from robsim.scenario import build
from robsim.scenario.problems import Problems
from robsim.scenario.schema import RobotFile
from robsim.scenario.tables import checked
from robsim.scenario.text import parse, read_text


def read_robot(path: str | os.PathLike[str]) -> Robot:
    """The robot of a file. FileError: the file cannot be read, or says what cannot be.

    >>> from robsim import robots
    >>> read_robot(robots.file("planar_2r")).nq
    2
    """
    source = str(path)
    problems = Problems(Path(source).name)
    table = checked(RobotFile, parse(read_text(path), source), problems)
    with problems.at():
        return build.robot(table)
    problems.stop()
    raise AssertionError("a robot is built or there is a problem")
