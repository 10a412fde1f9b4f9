"""Text tables: aligned for a terminal, as comma-separated values and as LaTeX."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence

from robsim.base.html import format_html_table

_LATEX = str.maketrans(
    {
        **{mark: f"\\{mark}" for mark in "&%$#_{}"},
        **{"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"},
        **{"<": "$<$", ">": "$>$"},
    }
)


class TabularValue:
    """Base of values that are printed as tables; subclasses return the rows and heads."""

    def _title(self) -> str:
        """Return the title above the table in a notebook."""
        raise NotImplementedError

    def _texts(self) -> list[list[str]]:
        """Return the columns as texts, each with its head first."""
        raise NotImplementedError

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, with numbers in full precision; NaN for missing ones."""
        raise NotImplementedError

    def _notes(self) -> list[str]:
        """Return the lines below the table."""
        return []

    def csv(self) -> str:
        """Return the table as comma-separated values in full precision; NaN is an empty cell."""
        return format_csv(self._numbers())

    def latex(self) -> str:
        """Return the table as LaTeX, for \\usepackage{booktabs}."""
        return format_latex(list(zip(*self._texts(), strict=True)))

    def __str__(self) -> str:
        """Return the table with its notes."""
        return "\n".join([*align_columns(self._texts()), *self._notes()])

    def __repr__(self) -> str:
        """Return the table, as a notebook shows it as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        head, *rows = zip(*self._texts(), strict=True)
        return format_html_table(self._title(), rows, head, "\n".join(self._notes()))


def align_columns(columns: Sequence[Sequence[str]], left: int = 2) -> list[str]:
    """Return the lines of a table: the first `left` columns flush left, the others right.

    >>> align_columns([["name", "a"], ["", "b"], ["value", "1"]])
    ['name     value', 'a     b      1']
    """
    widths = [max(map(len, column)) for column in columns]
    padded = [
        [text.ljust(width) if i < left else text.rjust(width) for text in column]
        for i, (column, width) in enumerate(zip(columns, widths, strict=True))
    ]
    return ["  ".join(row).rstrip() for row in zip(*padded, strict=True)]


def format_digits(value: float) -> str:
    """Return a number to three digits; "-" for NaN, and "0" for rounding errors.

    >>> format_digits(0.12345), format_digits(4321.0), format_digits(1e-12)
    ('0.123', '4321', '0')
    """
    if math.isnan(value):
        return "-"
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.0f}" if 100 <= abs(value) < 1e5 else f"{value:.3g}"


def format_csv(rows: Iterable[Sequence[object]]) -> str:
    """Return rows as comma-separated values; NaN is an empty cell.

    >>> format_csv([("name", "value"), ("a, b", 0.1), ("c", math.nan)])
    'name,value\\n"a, b",0.1\\nc,\\n'
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [_format_exact(cell) for cell in row] for row in rows
    )
    return text.getvalue()


def _format_exact(cell: object) -> object:
    return "" if isinstance(cell, float) and math.isnan(cell) else cell


def format_latex(rows: Sequence[Sequence[str]]) -> str:
    """Return rows, head first, as a LaTeX tabular with the rules of the package booktabs.

    Texts are escaped. The first two columns are flush left.

    >>> print(format_latex([("name", "", "share"), ("a_b", "", "50 %")]))
    \\begin{tabular}{llr}
    \\toprule
    name &  & share \\\\
    \\midrule
    a\\_b &  & 50 \\% \\\\
    \\bottomrule
    \\end{tabular}
    """
    head, *body = (" & ".join(map(_escape_latex, row)) + r" \\" for row in rows)
    columns = "ll" + "r" * (len(rows[0]) - 2)
    lines = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", head, r"\midrule", *body]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def _escape_latex(text: str) -> str:
    """Return a text for LaTeX, with a minus sign in negative numbers."""
    text = re.sub(r"(?<!\w)-(?=\d)", "$-$", text.translate(_LATEX))
    return re.sub(r"^\[", "{[}", text)  # else an argument of the line break before it
