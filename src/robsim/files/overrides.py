"""Changes to a scenario text, such as task.gain=2 or cameras.eye.size=[320, 240]."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from robsim.base.arrays import has_items
from robsim.base.errors import InputError, format_value
from robsim.declare.context import PythonValue
from robsim.declare.lists import get_item_label
from robsim.declare.name_lookup import NAMED

Changes = Mapping[str, Any] | Iterable[str]
DEEPEST = 16
EMPTY = ("shapes", "marks", "distortion", "sources", "weighting")  # lists that may be empty


def parse_changes(changes: Changes) -> list[tuple[str, Any]]:
    """Return (dotted name, value) of each change; InputError for an invalid change."""
    if isinstance(changes, Mapping):
        return [(key, parse_toml_value(text)) for key, text in changes.items()]
    if isinstance(changes, str):
        changes = [changes]
    if not has_items(changes):
        raise InputError(f"{format_value(changes)}: expected key=value, or several of them")
    return [_parse_change(change) for change in changes]


def parse_toml_value(text: Any) -> Any:
    """Return the TOML value of a text; a text that is not TOML is returned unchanged.

    For example, 20 ms needs no quotes.

    >>> parse_toml_value("[1, 2.5]"), parse_toml_value("20 ms")
    ([1, 2.5], '20 ms')
    """
    if not isinstance(text, str):
        return text
    try:
        tables = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return tables["value"] if len(tables) == 1 else text


def nest_value(path: Any, value: Any, python: bool = False) -> dict[str, Any]:
    """Return the tables with one value at a dotted path.

    With `python` the value is a Python object, else a TOML value.

    >>> nest_value("cameras.eye.size", [320, 240])
    {'cameras': [{'name': 'eye', 'size': [320, 240]}]}
    """
    keys = path.split(".") if isinstance(path, str) else []
    if not _is_settable(keys):
        example = "task.gain or cameras.NAME.size"
        raise InputError(f"{format_value(path)} cannot be set; expected a path such as {example}")
    if isinstance(value, dict | list) and not value and keys[-1] not in EMPTY:
        raise InputError(f"{path}: {format_value(value)} changes nothing; name the value to change")
    tables: Any = PythonValue(value) if python and not isinstance(value, str) else value
    for i in range(len(keys) - 1, -1, -1):
        if i > 0 and keys[i - 1] in NAMED:
            tables = [{NAMED[keys[i - 1]]: keys[i], **tables}]
        else:
            tables = {keys[i]: tables}
    return dict(tables)


def merge_tables(old: Any, new: Any) -> Any:
    """Return tables with the values of later changes merged into them.

    >>> merge_tables({"task": {"gain": 1}}, {"task": {"law": "camera"}})
    {'task': {'gain': 1, 'law': 'camera'}}
    """
    if isinstance(old, PythonValue) and isinstance(new, Mapping):
        return PythonValue(old.value, merge_tables(old.changes or {}, new))
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        return {**old, **{key: merge_tables(old.get(key), each) for key, each in new.items()}}
    if not (isinstance(old, list) and isinstance(new, list)):
        return new
    before, after = (
        {get_item_label(each, i): each for i, each in enumerate(some)} for some in (old, new)
    )
    return (
        list(merge_tables(before, after).values())
        if all(isinstance(n, str) for n in after)
        else new
    )


def _parse_change(change: Any) -> tuple[str, Any]:
    key, equals, text = change.partition("=") if isinstance(change, str) else ("", "", "")
    if not equals:
        raise InputError(f"{format_value(change)}: expected key=value, as in task.gain=2")
    return key.strip(), parse_toml_value(text.strip())


def _is_settable(keys: list[str]) -> bool:
    """Return whether keys lead to a value, and not to a table, a name or the schema."""
    whole = bool(keys) and all(keys) and len(keys) <= DEEPEST and keys != ["schema"]
    names = [i + 1 for i, key in enumerate(keys) if key in NAMED]
    renames = len(keys) - 2 in names and keys[-1] == NAMED[keys[-3]]
    return whole and len(keys) - 1 not in names and not renames
