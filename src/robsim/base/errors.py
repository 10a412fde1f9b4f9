"""The errors that are raised before or around a run; one inside a run is data, see `Outcome`.

RobSimError
├── InputError (also a ValueError)   something given is not usable
│   ├── UnitError                    a quantity without its unit, or with another's
│   ├── FrameError                   poses that do not join, or a frame that does not exist
│   ├── GoalError                    a goal that the camera cannot see or the robot not reach
│   └── FileError                    a file that cannot be read, understood or written
└── Interrupted                      Ctrl-C or its like; holds what was simulated in `.run`

RankWarning                          the features cannot fix every motion of the camera
UnitWarning                          a number that looks like degrees or mm, taken as rad or m
FileWarning                          a file has oddities, which are left out or read otherwise
FitWarning                           what was calibrated does not fit its views
ReplayWarning                        a run that is simulated again is another one
"""

import difflib
import reprlib
from collections.abc import Collection, Container, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


class RobSimError(Exception):
    """The base class of every error that RobSim raises on purpose."""


class InputError(RobSimError, ValueError):
    """An input is not usable; the message says what was expected and what exists."""

    path: str = ""  # of keys, to where this is in a text or a thing; in front of the message

    @property
    def text(self) -> str:
        """The message without the path."""
        return super().__str__()

    def __str__(self) -> str:
        """Return the path, if any, and the message."""
        return f"{self.path}: {self.text}" if self.path else self.text


class UnitError(InputError):
    """A quantity has no unit, or a unit of another dimension."""


class FrameError(InputError):
    """The frames of two poses do not match, or a frame does not exist."""


class GoalError(InputError):
    """The camera cannot see a goal, or the robot cannot reach it."""


class FileError(InputError):
    """A file cannot be read, understood or written."""


class Interrupted(RobSimError):
    """The user stopped the simulation; `run` is the Dataset of what was done until then."""

    def __init__(self, message: str, run: Any):
        super().__init__(message)
        self.run = run


class RankWarning(UserWarning):
    """The features do not fix every motion that the robot can make."""


class UnitWarning(UserWarning):
    """A number looks as if it were given in another unit than the one in which it is taken."""


class FileWarning(UserWarning):
    """A file was read in part: the message says, line by line, what was left out or changed."""


class FitWarning(UserWarning):
    """What was found does not fit what it was found from; the message says where it fits worst."""


class ReplayWarning(UserWarning):
    """A run has other numbers than the same simulation has now; the message says the first."""


def format_value(value: object) -> str:
    """Return how a message shows a value that was given: short, and on one line.

    >>> format_value("cm" * 1000), format_value(10**5000)
    ("'cmcmcmcmcmcmcmcmcmcmcmcmcm...mcmcmcmcmcmcmcmcmcmcmcmcmcm'", '0x...')
    """
    text = " ".join(_SHORT.repr(value).split("\n"))
    return text if len(text) <= 120 else f"{text[:116]} ..."


class _ShortRepr(reprlib.Repr):
    """The short texts of values, also of whole numbers that Python writes in hexadecimal only."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxlong = 60
        self.maxother = 80
        self.maxlevel, self.maxdict, self.maxlist = 3, 4, 9

    def repr_int(self, x: int, level: int) -> str:
        return super().repr_int(x, level) if x.bit_length() < 10_000 else "0x..."


_SHORT = _ShortRepr()


def is_known_name(name: object, exist: Container[str]) -> bool:
    """Return whether this is a name that exists: an array, say, is none."""
    return isinstance(name, str) and name in exist


def suggest_names(name: object, exists: Iterable[str], kind: str) -> str:
    """Return the end of a message on an unknown name: the nearest name, and all that exist.

    >>> suggest_names("tol", ["base", "tool"], "frames")
    "did you mean 'tool'? frames: base, tool"
    """
    names = list(exists)
    near = difflib.get_close_matches(name if isinstance(name, str) else "", names, n=1, cutoff=0.5)
    guess = f"did you mean '{near[0]}'? " if near else ""
    return f"{guess}{kind}: {', '.join(names) or 'none'}"


def check_known(name: object, exist: Collection[str], no: str, kind: str) -> None:
    """Raise InputError unless a name is one of those that exist; `no` says it: "no frame {}"."""
    if not is_known_name(name, exist):
        raise InputError(f"{no.format(format_value(name))}; {suggest_names(name, exist, kind)}")


@contextmanager
def raise_file_errors(where: object) -> Iterator[None]:
    """Raise FileError, which names a file or a place in one, for another InputError from inside."""
    try:
        yield
    except FileError:  # has been said
        raise
    except InputError as error:
        raise FileError(f"{where}: {error}") from None


@contextmanager
def prefix_errors(what: str) -> Iterator[None]:
    """Put what an InputError from inside is about in front of it, such as "phase 'lift'"."""
    try:
        yield
    except InputError as error:
        raise type(error)(f"{what}: {error}") from None
