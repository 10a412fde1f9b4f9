"""Errors and warnings of RobSim. Errors within a run are outcomes, see `Outcome`.

RobSimError
├── InputError (also a ValueError)   an argument is not valid
│   ├── UnitError                    a quantity without a unit, or with a wrong one
│   ├── FrameError                   poses with different frames, or an unknown frame
│   ├── GoalError                    a goal out of view or out of reach
│   ├── CodeError                    a wrong result of a class of the user's own code
│   ├── ParameterError               an unknown parameter of a class (also a TypeError)
│   └── FileError                    a file that cannot be read, parsed or written
└── Interrupted                      a stop by the user; the run so far is in `.run`

RankWarning                          features that leave camera motions free
UnitWarning                          a number that looks like degrees or millimetres
FileWarning                          parts of a file that were skipped or changed
FitWarning                           a calibration that does not fit its views
ReplayWarning                        a repeated run that differs
"""

import difflib
import reprlib
from collections.abc import Collection, Container, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


class RobSimError(Exception):
    """Base class of all errors that RobSim raises on purpose.

    >>> import robsim as rs
    >>> try:
    ...     rs.PBVS(gain=-1.0)
    ... except rs.RobSimError as error:
    ...     print(type(error).__name__)
    InputError
    """


class InputError(RobSimError, ValueError):
    """Error about an argument that is not valid.

    The message gives the expected and the existing values.

    Attributes
    ----------
    path : str
        Keys that lead to the value in a text or an object, in front of the message.
    text : str
        Message without the path.

    Examples
    --------
    >>> import robsim as rs
    >>> try:
    ...     rs.PBVS(gain=-1.0)
    ... except rs.errors.InputError as error:
    ...     print(error)
    PBVS.gain must be a positive number (per second), got -1.0
    """

    path: str = ""

    @property
    def text(self) -> str:
        """The message without the path."""
        return super().__str__()

    def __str__(self) -> str:
        """Return the path, if there is one, and the message."""
        return f"{self.path}: {self.text}" if self.path else self.text


class UnitError(InputError):
    """Error about a quantity without a unit, or with a unit of another dimension.

    >>> from robsim.units import parse
    >>> parse("5 kg", "length")
    Traceback (most recent call last):
    ...
    robsim.base.errors.UnitError: '5 kg': expected one number with a unit of length (m, ...
    """


class FrameError(InputError):
    """Error about poses with different frames, or about an unknown frame.

    >>> issubclass(FrameError, InputError)
    True
    """


class GoalError(InputError):
    """Error about a goal out of view of the camera, or out of reach of the robot.

    >>> issubclass(GoalError, InputError)
    True
    """


class CodeError(InputError):
    """Error about a wrong result of a user's own class, which no file contains.

    >>> import robsim as rs
    >>> class Fast:
    ...     def command(self, state):
    ...         return [1.0]
    >>> experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> experiment.at("task.law", Fast()).run()
    Traceback (most recent call last):
    ...
    robsim.base.errors.CodeError: Fast.command returned shape (1,) where (1, 6) is needed; ...
    """


class ParameterError(InputError, TypeError):
    """Error about an unknown parameter of a class; a TypeError, as Python raises it, too.

    >>> import robsim as rs
    >>> rs.IBVS(gian=1.0)
    Traceback (most recent call last):
    ...
    robsim.base.errors.ParameterError: IBVS has no parameter 'gian'; did you mean 'gain'? ...
    """


class FileError(InputError):
    """Error about a file that cannot be read, parsed or written.

    >>> import robsim as rs
    >>> rs.load_scenario("nothing.toml")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: nothing.toml: no such file
    """


class Interrupted(RobSimError):
    """Error that the user stopped a simulation.

    Attributes
    ----------
    run : xarray.Dataset, MissionRun or list
        Results until the stop.

    Examples
    --------
    >>> Interrupted("stopped by the user", run=None).run is None
    True
    """

    # Any: a run, a MissionRun or a list, which higher rooms define
    def __init__(self, message: str, run: Any):
        super().__init__(message)
        self.run = run


class RankWarning(UserWarning):
    """Warning that the features leave some motions of the robot free.

    >>> issubclass(RankWarning, UserWarning)
    True
    """


class UnitWarning(UserWarning):
    """Warning about a number that looks as if it had another unit, such as degrees.

    >>> issubclass(UnitWarning, UserWarning)
    True
    """


class FileWarning(UserWarning):
    """Warning about skipped or changed parts of a file, one per line of the message.

    >>> issubclass(FileWarning, UserWarning)
    True
    """


class FitWarning(UserWarning):
    """Warning about a result that does not fit its data, with the place of the worst misfit.

    >>> issubclass(FitWarning, UserWarning)
    True
    """


class ReplayWarning(UserWarning):
    """Warning about a repeated run with other numbers, with the first difference.

    >>> issubclass(ReplayWarning, UserWarning)
    True
    """


def format_value(value: object) -> str:
    """Return a value as a short text in one line, for messages.

    >>> format_value("cm" * 1000), format_value(10**5000)
    ("'cmcmcmcmcmcmcmcmcmcmcmcmcm...mcmcmcmcmcmcmcmcmcmcmcmcmcm'", '0x...')
    """
    text = " ".join(_SHORT.repr(value).split("\n"))
    return text if len(text) <= 120 else f"{text[:116]} ..."


class _ShortRepr(reprlib.Repr):
    """Short representations of values, also of integers with very many digits."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxlong = 60
        self.maxother = 80
        self.maxlevel, self.maxdict, self.maxlist = 3, 4, 9

    def repr_int(self, x: int, level: int) -> str:
        return super().repr_int(x, level) if x.bit_length() < 10_000 else "0x..."


_SHORT = _ShortRepr()


def is_known_name(name: object, exist: Container[str]) -> bool:
    """Return whether a value is one of the existing names; values of other types are not."""
    return isinstance(name, str) and name in exist


def suggest_names(name: object, exists: Iterable[str], kind: str) -> str:
    """Return the end of a message about an unknown name: the nearest and all existing names.

    >>> suggest_names("tol", ["base", "tool"], "frames")
    "did you mean 'tool'? frames: base, tool"
    """
    names = list(exists)
    near = difflib.get_close_matches(name if isinstance(name, str) else "", names, n=1, cutoff=0.5)
    guess = f"did you mean '{near[0]}'? " if near else ""
    return f"{guess}{kind}: {', '.join(names) or 'none'}"


def check_known(name: object, exist: Collection[str], no: str, kind: str) -> None:
    """Raise InputError unless a name exists; `no` is the message, such as "no frame {}"."""
    if not is_known_name(name, exist):
        raise InputError(f"{no.format(format_value(name))}; {suggest_names(name, exist, kind)}")


@contextmanager
def raise_file_errors(where: object) -> Iterator[None]:
    """Convert an inner InputError to a FileError that names a file or a place in it."""
    try:
        yield
    except (FileError, CodeError):  # names the file already, or is not about the file
        raise
    except InputError as error:
        raise FileError(f"{where}: {error}") from None


@contextmanager
def prefix_errors(what: str) -> Iterator[None]:
    """Prepend the subject to an inner InputError, such as "phase 'lift'"."""
    try:
        yield
    except InputError as error:
        raise type(error)(f"{what}: {error}") from None
