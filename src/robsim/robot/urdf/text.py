"""XML as text: elements and their attributes, numbers with all their digits."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from xml.sax.saxutils import quoteattr

from robsim.base.errors import FileError

INDENT = "  "


class Text:
    """Lines of XML, indented; at any depth of elements."""

    def __init__(self) -> None:
        self.lines = ['<?xml version="1.0" encoding="utf-8"?>']
        self._open: list[str] = []

    def put(self, tag: str, **attributes: str | float | None) -> None:
        """An element without children; an attribute that is None is left out."""
        self.lines.append(f"{self._indent}<{_head(tag, attributes)}/>")

    def start(self, tag: str, **attributes: str | float | None) -> None:
        """An element whose children follow, until `end`."""
        self.lines.append(f"{self._indent}<{_head(tag, attributes)}>")
        self._open.append(tag)

    def end(self) -> None:
        """The end of the element that was started last."""
        tag = self._open.pop()
        self.lines.append(f"{self._indent}</{tag}>")

    @contextmanager
    def inside(self, tag: str, **attributes: str | float | None) -> Iterator[None]:
        """`start`, what is done inside, `end`."""
        self.start(tag, **attributes)
        yield
        self.end()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file; FileError if that cannot be."""
        try:
            Path(path).write_text("\n".join([*self.lines, ""]), encoding="utf-8")
        except (OSError, TypeError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise FileError(f"{str(path)!r:.200}: cannot be written: {reason}") from None

    @property
    def _indent(self) -> str:
        return INDENT * len(self._open)


def spaced(numbers: Iterable[float]) -> str:
    """The numbers with all their digits and spaces between them.

    >>> spaced([0.1, -0.0])
    '0.1 0.0'
    """
    return " ".join(repr(float(number) + 0.0) for number in numbers)


def _head(tag: str, attributes: Mapping[str, str | float | None]) -> str:
    """What stands between < and >; a key that Python has for itself ends in _."""
    given = {k.rstrip("_"): v for k, v in attributes.items() if v is not None}
    texts = {k: v if isinstance(v, str) else spaced([v]) for k, v in given.items()}
    return " ".join([tag, *(f"{key}={quoteattr(text)}" for key, text in texts.items())])
