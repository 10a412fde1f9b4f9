"""Tables of a benchmark in LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.suites import tables

SPECIAL = {each: f"\\{each}" for each in "&%$#_{}"} | {
    "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}",
}  # fmt: skip


def tabular(suite: Any, columns: Sequence[Sequence[str]]) -> str:
    """Return a tabular of columns of text, of which the first two are flush left."""
    head, *rows = ([_escaped(cell) for cell in row] for row in zip(*columns, strict=True))
    lines = [
        f"% {tables.heading(suite)}".replace("\n", " "),
        f"\\begin{{tabular}}{{ll{'r' * (len(columns) - 2)}}}",
        "\\hline",
        f"{' & '.join(head)} \\\\",
        "\\hline",
        *(f"{' & '.join(row)} \\\\" for row in rows),
        "\\hline",
        "\\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    r"""Return a text as LaTeX prints it.

    >>> _escaped("10 % of x_1")
    '10 \\% of x\\_1'
    """
    return "".join(SPECIAL.get(each, each) for each in text)
