"""Writing of XML: elements with their attributes, and numbers with all their digits."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from xml.sax.saxutils import quoteattr

from robsim.base.atomic_files import write_whole

INDENT = "  "


class XmlWriter:
    """Lines of an XML file, indented by the depth of the elements."""

    def __init__(self) -> None:
        self.lines = ['<?xml version="1.0" encoding="utf-8"?>']
        self._open: list[str] = []

    def put(self, tag: str, **attributes: str | float | None) -> None:
        """Add an element without children; attributes of None are left out."""
        self.lines.append(f"{self._indent}<{_format_start_tag(tag, attributes)}/>")

    def start(self, tag: str, **attributes: str | float | None) -> None:
        """Add the start of an element with children; `end` closes it."""
        self.lines.append(f"{self._indent}<{_format_start_tag(tag, attributes)}>")
        self._open.append(tag)

    def end(self) -> None:
        """Add the end of the element that was started last."""
        tag = self._open.pop()
        self.lines.append(f"{self._indent}</{tag}>")

    @contextmanager
    def open_element(self, tag: str, **attributes: str | float | None) -> Iterator[None]:
        """Add an element around all elements that are added within a `with` block."""
        self.start(tag, **attributes)
        yield
        self.end()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file; raise FileError if writing fails."""
        write_whole(path, "\n".join([*self.lines, ""]))

    @property
    def _indent(self) -> str:
        """Indentation of the present depth."""
        return INDENT * len(self._open)


def join_numbers(numbers: Iterable[float]) -> str:
    """Return numbers with all their digits, separated by spaces.

    >>> join_numbers([0.1, -0.0])
    '0.1 0.0'
    """
    return " ".join(repr(float(number) + 0.0) for number in numbers)


def _format_start_tag(tag: str, attributes: Mapping[str, str | float | None]) -> str:
    """Return the text between < and >; a key with a _ at its end stands for a Python keyword."""
    present = {k.rstrip("_"): v for k, v in attributes.items() if v is not None}
    texts = {k: v if isinstance(v, str) else join_numbers([v]) for k, v in present.items()}
    return " ".join([tag, *(f"{key}={quoteattr(text)}" for key, text in texts.items())])
