"""The errors and oddities of a file, collected and reported together."""

from __future__ import annotations

import re
import warnings

from robsim.base.errors import FileError, FileWarning
from robsim.base.xml_elements import Element

MOST_ERRORS = 50  # errors after which a file is not read further
MOST_ODDITIES = 1000
LISTED_KINDS = 10  # kinds of oddities that one warning lists
LONGEST_LINE = 600  # characters of a line
_VARIABLE_TEXT = re.compile(r"'[^']*'|[-+]?[\d.]+(e[-+]?\d+)?")  # what differs within a kind


class Diagnostics:
    """The errors and oddities of one file, each with its line and its element."""

    def __init__(self, source: str):
        self.source = source
        self.errors: list[str] = []
        self.oddities: dict[tuple[str, str], list[tuple[int, str]]] = {}  # by tag and kind
        self.odd_count = 0

    def error(self, element: Element, text: str) -> None:
        """Add an error; raise FileError if there are too many."""
        line = self._line(element, text)
        if line not in self.errors:
            self.errors.append(line)
        if len(self.errors) == MOST_ERRORS:
            self.errors.append(f"{self.source}: and maybe more: it was not read further")
            self.stop()

    def odd(self, element: Element, text: str) -> None:
        """Add an oddity: something that is left out, or read otherwise than it is written."""
        if self.odd_count == MOST_ODDITIES:
            self.error(element, f"more than {MOST_ODDITIES} unknown words and the like")
            self.stop()
        self.odd_count += 1
        kind = element.tag, _VARIABLE_TEXT.sub("", text)
        found = self.oddities.setdefault(kind, [])
        found.append((element.line, self._line(element, text)))

    def stop(self) -> None:
        """Raise FileError if there were errors, with one line for each."""
        if self.errors:
            raise FileError("\n".join(self.errors)) from None

    def warn(self) -> None:
        """Give one FileWarning if there were oddities: the first of each kind, and other lines."""
        if self.oddities:
            kinds = list(self.oddities.values())
            more = sum(map(len, kinds[LISTED_KINDS:]))
            rest = [f"{self.source}: and {more} more"] if more else []
            text = "\n".join([*map(_format_oddities, kinds[:LISTED_KINDS]), *rest])
            warnings.warn(text, FileWarning, stacklevel=4)  # where Robot.from_urdf is called

    def _line(self, element: Element, text: str) -> str:
        line = f"{self.source}:{element.line}: {element.label}: {text}"
        return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 4]} ..."


def _format_oddities(found: list[tuple[int, str]]) -> str:
    """Return the message for the first oddity of a kind, with the lines of the others."""
    (_, first), *others = found
    if not others:
        return first
    lines = [str(line) for line in sorted({line for line, _ in others})]
    where = f"line{'s' if len(lines) > 1 else ''} {', '.join(lines)}"
    return f"{first} ({len(others)} more of the kind, in {where})"
