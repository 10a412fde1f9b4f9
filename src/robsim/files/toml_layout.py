"""The layout of TOML texts for people: short values in one line, long ones in sections."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from robsim.files.toml import SCHEMA, Tables

WIDTH = 120  # longest line in characters
ITEM = 240  # longest line of a table within a list
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
    return "\n".join([f"schema = {SCHEMA}", *_format_section((), tables)]) + "\n"


def _format_section(path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table; values without a section come first."""
    apart = {key: raw for key, raw in table.items() if _needs_section(path, key, raw)}
    for key, raw in table.items():
        if key not in apart:
            yield from _format_value_lines(f"{_format_key(key)} = ", raw)
    for key, raw in apart.items():
        inner = (*path, _format_key(key))
        for each in raw if isinstance(raw, list) else [raw]:
            name = f"[{'.'.join(inner)}]"
            yield from ("", f"[{name}]" if isinstance(raw, list) else name)
            yield from _format_section(inner, each)


def _needs_section(path: tuple[str, ...], key: str, raw: Any) -> bool:
    """Return whether a value becomes a section: top-level or too long for a line."""
    if isinstance(raw, Mapping):
        return not path or len(f"{_format_key(key)} = {_format_inline(raw)}") > WIDTH
    if not isinstance(raw, list) or not raw or not all(isinstance(each, Mapping) for each in raw):
        return False
    return not path or any(len(_format_inline(each)) > ITEM for each in raw)


def _format_value_lines(start: str, raw: Any) -> Iterator[str]:
    """Yield the lines of a value; a long list is wrapped."""
    whole = start + _format_inline(raw)
    if len(whole) <= WIDTH or not isinstance(raw, list):
        yield whole
        return
    yield f"{start}["
    line = "   "
    for each in raw:
        part = f" {_format_inline(each)},"
        if line.strip() and (isinstance(each, Mapping) or len(line) + len(part) > WIDTH):
            yield line
            line = "   "
        line += part
    yield from (line, "]")


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
