"""HTML tables for notebooks, with escaped texts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_CELL = "text-align: left; padding: 0.15em 0.8em 0.15em 0"


def format_html_table(
    title: str, rows: Iterable[Sequence[object]], head: Sequence[object] = (), note: str = ""
) -> str:
    """Return an HTML table from rows of texts or numbers, with a title and a note.

    `head` names the columns. A row with fewer cells than the head is filled with empty cells.

    >>> format_html_table("a < b", [("x", 1)]).count("&lt;")
    1
    """
    parts = [f"<div><strong>{_escape_lines(title)}</strong><table>"]
    if head:
        parts.append(f"<thead>{_format_html_row('th', head)}</thead>")
    body = "".join(_format_html_row("td", row) for row in rows)
    parts.append(f"<tbody>{body}</tbody></table>")
    if note:
        parts.append(f"<p>{_escape_lines(note)}</p>")
    return "".join([*parts, "</div>"])


def _format_html_row(kind: str, cells: Sequence[object]) -> str:
    columns = "".join(f'<{kind} style="{_CELL}">{_escape_lines(cell)}</{kind}>' for cell in cells)
    return f"<tr>{columns}</tr>"


def _escape_lines(text: object) -> str:
    return escape(str(text)).replace("\n", "<br>")
