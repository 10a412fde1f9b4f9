"""The robot library: one TOML file per robot, each number with its source.

Every robot is also a function of this module: `robots.rhino_xr4()` equals
`robots.load("rhino_xr4")`.

>>> {"rhino_xr4", "puma560", "ur5e"} <= set(names())
True
>>> rhino = load("rhino_xr4")  # or robsim.robots.rhino_xr4()
>>> rhino.fk(rhino.home).round(4)[:3, 3]
array([0.2381, 0.    , 0.3207])
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from robsim.base.errors import check_known

if TYPE_CHECKING:
    from robsim.robot.robot import Robot


def names() -> tuple[str, ...]:
    """Return the names of the robots of the library, in alphabetical order.

    >>> len(names()) >= 20
    True
    """
    files = resources.files(__name__).iterdir()
    return tuple(sorted(Path(f.name).stem for f in files if f.name.endswith(".toml")))


def file(name: str) -> Path:
    """Return the path of the file of a robot.

    Parameters
    ----------
    name : str
        Name of a robot; see `names`.

    Returns
    -------
    pathlib.Path
        Path of the TOML file.

    Raises
    ------
    InputError
        If the robot does not exist. The message lists all names.

    Examples
    --------
    >>> file("ur5e").name
    'ur5e.toml'
    """
    check_known(name, names(), "no robot {} in the library", "robots")
    return Path(str(resources.files(__name__) / f"{name}.toml"))


def about(name: str) -> str:
    """Return a one-line description of a robot.

    >>> about("planar_2r")
    'Planar arm with two revolute joints and links of one metre, the exercise of every textbook'
    """
    return str(tomllib.loads(file(name).read_text(encoding="utf-8"))["about"])


def load(name: str) -> Robot:
    """Return a robot of the library.

    Parameters
    ----------
    name : str
        Name of a robot; see `names`.

    Returns
    -------
    Robot
        The robot. It is read once and shared, and robots are immutable.

    Raises
    ------
    InputError
        If the robot does not exist. The message lists all names.

    Examples
    --------
    >>> load("ur5e").nq
    6
    """
    return _read_library_robot(file(name))


@cache
def _read_library_robot(path: Path) -> Robot:
    from robsim.files.robot_library import read_robot
    from robsim.robot.robot_origin import RobotOrigin

    return replace(read_robot(path), origin=RobotOrigin(model=path.stem))


def __getattr__(name: str) -> Callable[[], Robot]:
    if name.startswith("_") or name not in names():
        raise AttributeError(f"no robot {name!r} in the library; robots: {', '.join(names())}")
    return _make_loader(name)


@cache
def _make_loader(name: str) -> Callable[[], Robot]:
    def load_named() -> Robot:
        return load(name)

    load_named.__name__ = load_named.__qualname__ = name
    load_named.__doc__ = f"""Return the robot {name!r} of the library: {about(name)}

    >>> from robsim import robots
    >>> robots.{name}().name
    {name!r}
    """
    return load_named


def __dir__() -> list[str]:
    return sorted({*globals(), *names()})
