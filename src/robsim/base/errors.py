"""What can go wrong before or around a run. A run that goes wrong is data: see `Outcome`.

RobSimError
├── InputError (also a ValueError)   something given is not usable
│   ├── UnitError                    a quantity without its unit, or with another's
│   ├── FrameError                   poses that do not join, or a frame that does not exist
│   ├── GoalError                    a goal that the camera cannot see or the robot not reach
│   └── FileError                    a file that cannot be read, understood or written
└── Interrupted                      Ctrl-C; holds what was simulated so far in `.run`

RankWarning                          the features cannot fix every motion of the camera
UnitWarning                          an angle that looks like degrees, where radians are taken
FileWarning                          a file has oddities, which are left out or read otherwise
"""

import difflib
from collections.abc import Iterable
from typing import Any


class RobSimError(Exception):
    """Every error that RobSim raises on purpose."""


class InputError(RobSimError, ValueError):
    """Something given is not usable; the message says what was expected and what exists."""


class UnitError(InputError):
    """A quantity without a unit, or with the unit of something else."""


class FrameError(InputError):
    """Two poses that do not meet in a frame, or a frame that does not exist."""


class GoalError(InputError):
    """A goal that the camera cannot see or the robot cannot take."""


class FileError(InputError):
    """A file that cannot be read, understood or written."""


class Interrupted(RobSimError):
    """The user stopped the simulation; `run` is the Dataset of what was done."""

    def __init__(self, message: str, run: Any):
        super().__init__(message)
        self.run = run


class RankWarning(UserWarning):
    """The features do not fix every motion that the robot can make."""


class UnitWarning(UserWarning):
    """A number looks as if it were given in another unit than the one in which it is taken."""


class FileWarning(UserWarning):
    """A file was read, but for some of it: the message says, line by line, what and how."""


def suggest(name: object, exists: Iterable[str], kind: str) -> str:
    """The end of a message about an unknown name: the nearest one, and all that exist.

    >>> suggest("tol", ["base", "tool"], "frames")
    "did you mean 'tool'? frames: base, tool"
    """
    names = list(exists)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    guess = f"did you mean '{near[0]}'? " if near else ""
    return f"{guess}{kind}: {', '.join(names) or 'none'}"
