"""The layout of TOML texts for people: short values in one line, long ones in sections."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
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
    lines, texts = list[str](), _InlineTexts()
    for layout in range(SECTIONED, DENSEST + 1):
        lines = [f"schema = {SCHEMA}", *_Layout(layout, texts).format_section((), tables)]
        if len(lines) <= MOST_LINES:
            break
    return "\n".join(lines) + "\n"


class _InlineTexts:
    """The texts of values in one line; the text of each table and list is made once."""

    def __init__(self) -> None:
        self._known = dict[int, tuple[Any, str]]()  # by identity; with the values, which stay alive

    def format(self, raw: Any) -> str:
        """Return a value in one line."""
        if isinstance(raw, str):
            return _format_text(raw)
        if isinstance(raw, bool):
            return "true" if raw else "false"
        if not isinstance(raw, Mapping | list):
            return repr(raw)
        if id(raw) not in self._known:
            self._known[id(raw)] = raw, self._format_inside(raw)
        return self._known[id(raw)][1]

    def _format_inside(self, raw: Mapping[str, Any] | list[Any]) -> str:
        if isinstance(raw, list):
            return f"[{', '.join(map(self.format, raw))}]"
        inside = ", ".join(f"{_format_key(key)} = {self.format(raw[key])}" for key in raw)
        return f"{{ {inside} }}" if inside else "{}"


@dataclass(frozen=True)
class _Layout:
    """A layout of sections, lists and tables in lines."""

    level: int
    texts: _InlineTexts

    def format_section(self, path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
        """Yield the lines of a table; values without a section come first."""
        apart = {key: raw for key, raw in table.items() if self._needs_section(path, key, raw)}
        lists = {key for key, raw in table.items() if isinstance(raw, list)}
        lists = {key for key in lists if len(self.texts.format(table[key])) > SHORT}
        for key, raw in sorted(table.items(), key=lambda each: each[0] in lists):
            if key in apart:
                continue
            yield from self._format_value_lines(f"{_format_key(key)} = ", raw, "")
        for key, raw in apart.items():
            inner = (*path, _format_key(key))
            for each in raw if isinstance(raw, list) else [raw]:
                name = f"[{'.'.join(inner)}]"
                yield from ("", f"[{name}]" if isinstance(raw, list) else name)
                yield from self.format_section(inner, each)

    def _needs_section(self, path: tuple[str, ...], key: str, raw: Any) -> bool:
        """Return whether a value becomes a section: top-level or too long for a line."""
        is_long = len(f"{_format_key(key)} = {self.texts.format(raw)}") > WIDTH
        if isinstance(raw, Mapping) and not (
            self.level == DENSEST and any(map(_is_list_of_tables, raw.values()))
        ):
            return is_long or (not path and self.level < INLINE)
        if not _is_list_of_tables(raw):
            return False
        if not path:
            return self.level < INLINE or (is_long and self.level < DENSEST)
        return self.level < LISTED and any(len(self.texts.format(each)) > ITEM for each in raw)

    def _format_value_lines(
        self, start: str, raw: Any, indent: str, end: str = ""
    ) -> Iterator[str]:
        """Yield the lines of a value; a long list is wrapped, and the list of a long table."""
        whole, inner = f"{indent}{start}{self.texts.format(raw)}{end}", indent + 4 * " "
        if isinstance(raw, Mapping) and len(whole) > WIDTH:
            name, last = next(
                (each for each in raw.items() if _is_list_of_tables(each[1])), ("", None)
            )
            if last is not None:
                rest = {key: each for key, each in raw.items() if key != name}
                opening = f"{self.texts.format(rest).removesuffix(' }')}," if rest else "{"
                start = f"{start}{opening} {_format_key(name)} = "
                raw, end = last, f" }}{end}"
        if len(whole) <= WIDTH or not isinstance(raw, list):
            yield whole
            return
        yield f"{indent}{start}["
        line = ""
        for each in raw:
            part = f"{self.texts.format(each)},"
            is_table = isinstance(each, Mapping)
            if line and (is_table or len(inner) + len(line) + 1 + len(part) > WIDTH):
                yield inner + line
                line = ""
            if is_table:
                yield from self._format_value_lines("", each, inner, ",")
            else:
                line = f"{line} {part}".lstrip()
        yield from ([inner + line] if line else [])
        yield f"{indent}]{end}"


def _is_list_of_tables(raw: Any) -> bool:
    return isinstance(raw, list) and bool(raw) and all(isinstance(each, Mapping) for each in raw)


def _format_key(key: str) -> str:
    return key if BARE.fullmatch(key) else _format_text(key)


def _format_text(text: str) -> str:
    return ENCODE(text).replace("\x7f", "\\u007F")
