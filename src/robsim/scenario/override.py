"""Changes from outside a file: task.gain=2 or cameras.eye.size=[320, 240]."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from robsim.base.errors import InputError
from robsim.scenario.belief import NAMED, merge, name_key
from robsim.scenario.problems import Problems, shown
from robsim.scenario.text import Raw

Changes = Mapping[str, Any] | Iterable[str]
_DEEPEST = 16
_EMPTY = ("shapes", "marks", "distortion", "sources")  # lists that may be made empty


def overridden(raw: Raw, changes: Changes, source: str) -> Raw:
    """The raw tables with every change made. FileError: no such name, or not a change."""
    problems = Problems(source)
    with problems.at():
        for path, value in _pairs(changes):
            raw = merge(raw, _nested(path, value))
    problems.stop()
    return raw


def value_of(text: Any) -> Any:
    """A TOML value; what is none is a text, so that 20 ms needs no quotes within quotes.

    >>> value_of("[1, 2.5]"), value_of("20 ms")
    ([1, 2.5], '20 ms')
    """
    if not isinstance(text, str):
        return text
    try:
        tables = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return tables["value"] if len(tables) == 1 else text


def _pairs(changes: Changes) -> Iterable[tuple[str, Any]]:
    if isinstance(changes, Mapping):
        return [(key, value_of(text)) for key, text in changes.items()]
    if isinstance(changes, str):
        changes = [changes]
    if not isinstance(changes, Iterable):
        raise InputError(f"{shown(changes)}: expected key=value, or several of them")
    return [_pair(change) for change in changes]


def _pair(change: Any) -> tuple[str, Any]:
    key, equals, text = change.partition("=") if isinstance(change, str) else ("", "", "")
    if not equals:
        raise InputError(f"{shown(change)}: expected key=value, as in task.gain=2")
    return key.strip(), value_of(text.strip())


def _nested(path: Any, value: Any) -> Raw:
    """The tables that hold one value: cameras.eye.size as {"cameras": [{"name": "eye", ...}]}."""
    keys = path.split(".") if isinstance(path, str) else []
    if not _can_be_set(keys):
        example = "task.gain or cameras.NAME.size"
        raise InputError(f"{shown(path)} cannot be set; expected a path such as {example}")
    if value in ({}, []) and keys[-1] not in _EMPTY:
        raise InputError(f"{path}: {shown(value)} changes nothing; name the value to change")
    tables: Any = value
    for i in range(len(keys) - 1, -1, -1):
        if i > 0 and keys[i - 1] in NAMED:
            tables = [{**tables, name_key(keys[i - 1]): keys[i]}]
        else:
            tables = {keys[i]: tables}
    return dict(tables)


def _can_be_set(keys: list[str]) -> bool:
    """Whether these keys lead to a value; not to a whole thing, its name, or the schema."""
    whole = bool(keys) and all(keys) and len(keys) <= _DEEPEST and keys != ["schema"]
    names = [i + 1 for i, key in enumerate(keys) if key in NAMED]
    renames = len(keys) - 2 in names and keys[-1] == name_key(keys[-3])
    return whole and len(keys) - 1 not in names and not renames
