"""Tables of Markdown, as texts and numbers."""

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """The cells of a table, as texts."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def column(self, name: str) -> list[str]:
        """Return the cells of the column with a title, which occurs once."""
        (at,) = (i for i, title in enumerate(self.head) if title == name)
        return [row[at] for row in self.rows]


def read_tables(text: str) -> list[Table]:
    """Return the tables of a text in their order."""
    found = re.findall(r"(?:^\|.*\|$\n?)+", text, re.M)
    return [_read_table(lines.strip().split("\n")) for lines in found]


def _read_table(lines: list[str]) -> Table:
    head, _, *rows = (tuple(cell.strip() for cell in line[1:-1].split("|")) for line in lines)
    return Table(head, tuple(rows))


def read_number(cell: str) -> float:
    """Return the number of a cell, in which commas separate thousands."""
    return float(cell.replace(",", ""))
