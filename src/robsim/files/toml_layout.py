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
    lines = list[str]()
    for layout in range(SECTIONED, DENSEST + 1):
        lines = [f"schema = {SCHEMA}", *_format_section((), tables, layout)]
        if len(lines) <= MOST_LINES:
            break
    return "\n".join(lines) + "\n"


def _format_section(path: tuple[str, ...], table: Mapping[str, Any], layout: int) -> Iterator[str]:
    """Yield the lines of a table; values without a section come first."""
    apart = {key: raw for key, raw in table.items() if _needs_section(path, key, raw, layout)}
    lists = {key for key, raw in table.items() if isinstance(raw, list)}
    lists = {key for key in lists if len(_format_inline(table[key])) > SHORT}
    for key, raw in sorted(table.items(), key=lambda each: each[0] in lists):
        if key in apart:
            continue
        yield from _format_value_lines(f"{_format_key(key)} = ", raw, "")
    for key, raw in apart.items():
        inner = (*path, _format_key(key))
        for each in raw if isinstance(raw, list) else [raw]:
            name = f"[{'.'.join(inner)}]"
            yield from ("", f"[{name}]" if isinstance(raw, list) else name)
            yield from _format_section(inner, each, layout)


def _needs_section(path: tuple[str, ...], key: str, raw: Any, layout: int) -> bool:
    """Return whether a value becomes a section: top-level or too long for a line."""
    is_long = len(f"{_format_key(key)} = {_format_inline(raw)}") > WIDTH
    if isinstance(raw, Mapping) and not (
        layout == DENSEST and any(map(_is_list_of_tables, raw.values()))
    ):
        return is_long or (not path and layout < INLINE)
    if not _is_list_of_tables(raw):
        return False
    if not path:
        return layout < INLINE or (is_long and layout < DENSEST)
    return layout < LISTED and any(len(_format_inline(each)) > ITEM for each in raw)


def _is_list_of_tables(raw: Any) -> bool:
    return isinstance(raw, list) and bool(raw) and all(isinstance(each, Mapping) for each in raw)


def _format_value_lines(start: str, raw: Any, indent: str, end: str = "") -> Iterator[str]:
    """Yield the lines of a value; a long list is wrapped, and the list of a long table."""
    whole, inner = f"{indent}{start}{_format_inline(raw)}{end}", indent + 4 * " "
    if isinstance(raw, Mapping) and len(whole) > WIDTH:
        name, last = next((each for each in raw.items() if _is_list_of_tables(each[1])), ("", None))
        if last is not None:
            rest = {key: each for key, each in raw.items() if key != name}
            opening = f"{_format_inline(rest).removesuffix(' }')}," if rest else "{"
            start = f"{start}{opening} {_format_key(name)} = "
            raw, end = last, f" }}{end}"
    if len(whole) <= WIDTH or not isinstance(raw, list):
        yield whole
        return
    yield f"{indent}{start}["
    line = ""
    for each in raw:
        part = f"{_format_inline(each)},"
        is_table = isinstance(each, Mapping)
        if line and (is_table or len(inner) + len(line) + 1 + len(part) > WIDTH):
            yield inner + line
            line = ""
        if is_table:
            yield from _format_value_lines("", each, inner, ",")
        else:
            line = f"{line} {part}".lstrip()
    yield from ([inner + line] if line else [])
    yield f"{indent}]{end}"


def _format_inline(raw: Any) -> str:
    """Return a value in one line."""
    if isinstance(raw, Mapping):
        inside = ", ".join(
            f"{_format_key(key)} = {_format_inline(each)}" for key, each in raw.items()
        )
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(raw, list):
        return f"[{', '.join(map(_format_inline, raw))}]"
    if isinstance(raw, str):
        return json.dumps(raw, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(raw, bool):
        return "true" if raw else "false"
    return repr(raw)


def _format_key(key: str) -> str:
    return key if BARE.fullmatch(key) else _format_inline(key)
