"""The layout of TOML texts for people: short values in one line, long ones in sections."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from robsim.files.toml import SCHEMA, Tables

SHORT = 40  # longer lists come last in their section
WIDTH = 120  # longest line in characters
ITEM = 240  # longest line of a table within a list
MOST_LINES = 59  # a longer text gets a denser layout; 60 with a remark at its head
SECTIONED, LISTED, INLINE, DENSEST = range(4)  # layouts: each has fewer sections than the previous
ENCODE = json.JSONEncoder(ensure_ascii=False).encode
BARE = re.compile(r"[A-Za-z0-9_-]+")


def format_toml(tables: Tables) -> str:
    """Return the TOML text of tables; top-level tables and lists of tables become sections.

    >>> print(format_toml({"title": "Two", "run": {"dt": "40 ms"}}))
    schema = 1
    title = "Two"
    <BLANKLINE>
    [run]
    dt = "40 ms"
    <BLANKLINE>
    """
    layout, lines = _Layout(), list[str]()
    for layout.level in range(SECTIONED, DENSEST + 1):
        lines = [f"schema = {SCHEMA}", *layout.format_section((), tables)]
        if len(lines) <= MOST_LINES:
            break
    return "\n".join(lines) + "\n"


class _Layout:
    """A layout of tables in lines; the text of each table and list in one line is made once."""

    def __init__(self) -> None:
        self.level = SECTIONED
        self._inline = dict[int, tuple[Any, str]]()  # by identity; with the values, which stay

    def _format_inline(self, raw: Any) -> str:
        """Return the text of a value in one line."""
        if isinstance(raw, str):
            return _format_text(raw)
        if not isinstance(raw, Mapping | list):
            return str(raw).lower() if isinstance(raw, bool) else repr(raw)
        if id(raw) not in self._inline:
            if isinstance(raw, list):
                text = f"[{', '.join(map(self._format_inline, raw))}]"
            else:
                parts = [f"{_format_key(key)} = {self._format_inline(raw[key])}" for key in raw]
                text = f"{{ {', '.join(parts)} }}" if parts else "{}"
            self._inline[id(raw)] = raw, text
        return self._inline[id(raw)][1]

    def format_section(self, path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
        """Yield the lines of a table; values without a section come first."""
        apart = {key: raw for key, raw in table.items() if self._needs_section(path, key, raw)}
        lists = {key for key, raw in table.items() if isinstance(raw, list)}
        lists = {key for key in lists if len(self._format_inline(table[key])) > SHORT}
        for key, raw in sorted(table.items(), key=lambda each: each[0] in lists):
            if key not in apart:
                yield from self._format_lines(f"{_format_key(key)} = ", raw, "")
        for key, raw in apart.items():
            inner = (*path, _format_key(key))
            for each in raw if isinstance(raw, list) else [raw]:
                name = f"[{'.'.join(inner)}]"
                yield from ("", f"[{name}]" if isinstance(raw, list) else name)
                yield from self.format_section(inner, each)

    def _needs_section(self, path: tuple[str, ...], key: str, raw: Any) -> bool:
        """Return whether a value becomes a section: top-level or too long for a line."""
        is_long = len(f"{_format_key(key)} = {self._format_inline(raw)}") > WIDTH
        if isinstance(raw, Mapping) and not (self.level == DENSEST and _find_lists_of_tables(raw)):
            return is_long or (not path and self.level < INLINE)
        if not _is_list_of_tables(raw):
            return False
        if not path:
            return self.level < INLINE or (is_long and self.level < DENSEST)
        return self.level < LISTED and any(len(self._format_inline(each)) > ITEM for each in raw)

    def _format_lines(self, start: str, raw: Any, indent: str, end: str = "") -> Iterator[str]:
        """Yield the lines of a value; a long list is wrapped, and the list of a long table."""
        whole, inner = f"{indent}{start}{self._format_inline(raw)}{end}", indent + 4 * " "
        if len(whole) > WIDTH and (tables := _find_lists_of_tables(raw)):
            name, last = tables[0]
            rest = {key: each for key, each in raw.items() if key != name}
            opening = f"{self._format_inline(rest).removesuffix(' }')}," if rest else "{"
            start = f"{start}{opening} {_format_key(name)} = "
            raw, end = last, f" }}{end}"
        if len(whole) <= WIDTH or not isinstance(raw, list):
            yield whole
            return
        yield f"{indent}{start}["
        line = ""
        for each in raw:
            part = f"{self._format_inline(each)},"
            is_table = isinstance(each, Mapping)
            if line and (is_table or len(inner) + len(line) + 1 + len(part) > WIDTH):
                yield inner + line
                line = ""
            if is_table:
                yield from self._format_lines("", each, inner, ",")
            else:
                line = f"{line} {part}".lstrip()
        yield from ([inner + line] if line else [])
        yield f"{indent}]{end}"


def _is_list_of_tables(raw: Any) -> bool:
    return isinstance(raw, list) and bool(raw) and all(isinstance(each, Mapping) for each in raw)


def _find_lists_of_tables(raw: Any) -> list[tuple[str, Any]]:
    """Return the values of a table that are lists of tables, with their keys."""
    items = raw.items() if isinstance(raw, Mapping) else ()
    return [each for each in items if _is_list_of_tables(each[1])]


def _format_key(key: str) -> str:
    return key if BARE.fullmatch(key) else _format_text(key)


def _format_text(text: str) -> str:
    return ENCODE(text).replace("\x7f", "\\u007F")
