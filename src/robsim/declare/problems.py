"""Collected errors of a text: location, invalid value and valid values of each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from robsim.base.errors import CodeError, FileError, InputError, format_value

SHOWN = 10  # largest number of problems in one error
LONGEST = 600  # characters of one problem


class UnreadableValue(Exception):
    """The signal that a value cannot be read because of errors that are already reported."""


@contextmanager
def prefix_path(*keys: str | int) -> Iterator[None]:
    """Prepend keys to the path of an InputError from inside.

    A FileError and a CodeError are unchanged: their messages are complete.

    >>> with prefix_path("cameras", "eye", "K"):
    ...     raise InputError("expected 9 numbers")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: cameras.eye.K: expected 9 numbers
    """
    try:
        yield
    except (CodeError, FileError):
        raise
    except InputError as error:
        error.path = join_keys(*keys, error.path)
        raise


class Problems:
    """The problems of one text, collected for a single error."""

    def __init__(self, source: str):
        self.source = source
        self.lines: list[str] = []
        self.hidden_count = 0  # number of problems that are not shown
        self.total_count = 0  # number of wrong values, shown or not

    @property
    def full(self) -> bool:
        """Whether no more problems are shown; further ones are only counted."""
        return len(self.lines) >= SHOWN

    def add(self, path: str, text: str) -> None:
        """Add a problem, unless it is listed already. Long paths and texts are shortened."""
        self.total_count += 1
        if self.full:
            self.hidden_count += 1
            return
        path = path if len(path) <= LONGEST // 2 else f"{path[:140]} ... {path[-140:]}"
        line = ": ".join(part for part in (self.source, path, text) if part)
        line = line if len(line) <= LONGEST else f"{line[: LONGEST - 4]} ..."
        if line not in self.lines:
            self.lines.append(line)

    @contextmanager
    def at(self, *keys: str | int) -> Iterator[None]:
        """Collect an InputError from inside, and continue."""
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
        """Raise an error if there were problems, a FileError if the text has a source.

        The error gives the first ten problems, one per line.
        """
        if self.lines:
            place = f"{self.source}: " if self.source else ""
            rest = [f"{place}and {self.hidden_count} more"] if self.hidden_count else []
            kind = FileError if self.source else InputError
            raise kind("\n".join([*self.lines, *rest])) from None


def join_keys(*keys: str | int) -> str:
    """Return a key path: join_keys('objects', 'cube', 'marks', 3) is 'objects.cube.marks[3]'."""
    path = ""
    for key in keys:
        part = f"[{key}]" if isinstance(key, int) else _shorten_key(key)
        path += part if not path or part.startswith("[") or not part else f".{part}"
    return path


def _shorten_key(key: str) -> str:
    """Return a key of a path, shortened if it is long; a joined path is unchanged."""
    return key if len(key) <= 200 and key.isprintable() else format_value(key)
