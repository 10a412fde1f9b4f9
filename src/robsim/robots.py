"""Library of robots; each robot is a TOML file, and each of its numbers has a source.

>>> from robsim import robots
>>> robots.rhino_xr4().nq  # the same as robots.load("rhino_xr4")
5
"""

from collections.abc import Callable

from robsim.files import robots as _library
from robsim.files.robots import load as load
from robsim.files.robots import names as names
from robsim.robot.robot import Robot


def __getattr__(name: str) -> Callable[[], Robot]:
    """Return the function that loads the robot of this name."""
    function: Callable[[], Robot] = getattr(_library, name)
    return function


def __dir__() -> list[str]:
    """Return the functions of the library, and the names of its robots."""
    return ["load", "names", *names()]
