"""The problems of a text: where each stands, what was given, and what would be valid."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from robsim.base.errors import FileError, InputError, format_value

SHOWN = 10  # problems that one error lists
LONGEST = 600  # characters of one problem


class UnreadableValue(Exception):
    """The signal that a value cannot be read, for reasons that are already reported."""


@contextmanager
def prefix_path(*keys: str | int) -> Iterator[None]:
    """Put these keys in front of the path of an InputError that comes from inside.

    A FileError stays as it is: it says all that is wrong, and where.

    >>> with prefix_path("cameras", "eye", "K"):
    ...     raise InputError("expected 9 numbers")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: cameras.eye.K: expected 9 numbers
    """
    try:
        yield
    except FileError:
        raise
    except InputError as error:
        error.path = join_keys(*keys, error.path)
        raise


class Problems:
    """The problems of one text, collected so that one error can list them all."""

    def __init__(self, source: str):
        self.source = source
        self.found: list[str] = []
        self.untold = 0  # how many more there are than are shown
        self.seen = 0  # how many values were wrong, told of or not

    @property
    def full(self) -> bool:
        """Whether as many problems are known as an error lists; more need only be counted."""
        return len(self.found) >= SHOWN

    def add(self, path: str, text: str) -> None:
        """Add a problem, unless it is known; a path or text that is too long is cut."""
        self.seen += 1
        if self.full:
            self.untold += 1
            return
        path = path if len(path) <= LONGEST // 2 else f"{path[:140]} ... {path[-140:]}"
        line = ": ".join(part for part in (self.source, path, text) if part)
        line = line if len(line) <= LONGEST else f"{line[: LONGEST - 4]} ..."
        if line not in self.found:
            self.found.append(line)

    @contextmanager
    def at(self, *keys: str | int) -> Iterator[None]:
        """Keep an InputError that comes from inside, and go on."""
        try:
            with prefix_path(*keys):
                yield
        except FileError:
            raise
        except InputError as error:
            self.add(error.path, error.text)
        except UnreadableValue:
            pass

    def stop(self) -> None:
        """Raise a FileError if there were problems: the first ten, one a line."""
        if self.found:
            place = f"{self.source}: " if self.source else ""
            rest = [f"{place}and {self.untold} more"] if self.untold else []
            raise FileError("\n".join([*self.found, *rest])) from None


def join_keys(*keys: str | int) -> str:
    """Return a key path: joined('objects', 'cube', 'marks', 3) is 'objects.cube.marks[3]'."""
    path = ""
    for key in keys:
        part = f"[{key}]" if isinstance(key, int) else _shorten_key(key)
        path += part if not path or part.startswith("[") or not part else f".{part}"
    return path


def _shorten_key(key: str) -> str:
    """Return a key of the path; a path that is already joined stays as it is."""
    return key if len(key) <= 200 and key.isprintable() else format_value(key)
