"""Errors and oddities of a file, collected and reported together."""

from __future__ import annotations

import re
import warnings

from robsim.base.errors import FileError, FileWarning
from robsim.base.xml_elements import Element

MOST_ERRORS = 50  # number of errors that ends the reading of a file
MOST_ODDITIES = 1000
LISTED_KINDS = 10  # largest number of kinds of oddities in a warning
LONGEST_LINE = 600  # largest number of characters in a line
# parts of a message that differ between oddities of one kind: names and numbers
_VARIABLE_TEXT = re.compile(r"'[^']*'|[-+]?[\d.]+(e[-+]?\d+)?")


class Diagnostics:
    """Errors and oddities of one file, each with its line and its element.

    An oddity is an item that is left out or read differently from its notation.
    """

    def __init__(self, source: str):
        self.source = source
        self.errors: list[str] = []
        self.oddities: dict[tuple[str, str], list[tuple[int, str]]] = {}  # by tag and kind
        self.odd_count = 0

    def error(self, element: Element, text: str) -> None:
        """Add an error; raise FileError if there are too many."""
        line = self._format_line(element, text)
        if line not in self.errors:
            self.errors.append(line)
        if len(self.errors) == MOST_ERRORS:
            self.errors.append(f"{self.source}: and maybe more: it was not read further")
            self.stop()

    def odd(self, element: Element, text: str) -> None:
        """Add an oddity; raise FileError if there are too many."""
        if self.odd_count == MOST_ODDITIES:
            self.error(element, f"more than {MOST_ODDITIES} oddities, such as unknown words")
            self.stop()
        self.odd_count += 1
        kind = element.tag, _VARIABLE_TEXT.sub("", text)
        messages = self.oddities.setdefault(kind, [])
        messages.append((element.line, self._format_line(element, text)))

    def stop(self) -> None:
        """Raise FileError if there are errors, with one line for each."""
        if self.errors:
            raise FileError("\n".join(self.errors)) from None

    def warn(self) -> None:
        """Issue one FileWarning if there are oddities: the first of each kind, and other lines."""
        if self.oddities:
            kinds = list(self.oddities.values())
            more = sum(map(len, kinds[LISTED_KINDS:]))
            rest = [f"{self.source}: and {more} more"] if more else []
            text = "\n".join([*map(_format_oddities, kinds[:LISTED_KINDS]), *rest])
            warnings.warn(text, FileWarning, stacklevel=4)  # points at the call of Robot.from_urdf

    def _format_line(self, element: Element, text: str) -> str:
        """Return a message with file, line and element, shortened if necessary."""
        line = f"{self.source}:{element.line}: {element.label}: {text}"
        return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 4]} ..."


def _format_oddities(oddities: list[tuple[int, str]]) -> str:
    """Return the message for the first oddity of a kind, with the lines of the others."""
    (_, first), *others = oddities
    if not others:
        return first
    lines = [str(line) for line in sorted({line for line, _ in others})]
    numbers = f"line{'s' if len(lines) > 1 else ''} {', '.join(lines)}"
    return f"{first} ({len(others)} more of the kind, in {numbers})"
