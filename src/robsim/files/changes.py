"""Changes to a text from outside, such as task.gain=2 or cameras.eye.size=[320, 240]."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from robsim.base.arrays import is_listed
from robsim.base.errors import InputError, said
from robsim.declare.lists import label
from robsim.declare.lookup import NAMED
from robsim.declare.spec import Given

Changes = Mapping[str, Any] | Iterable[str]
DEEPEST = 16
EMPTY = ("shapes", "marks", "distortion", "sources", "weighting")  # lists that may be made empty


def pairs(changes: Changes) -> list[tuple[str, Any]]:
    """Return (dotted name, value) of each change; InputError if it is none."""
    if isinstance(changes, Mapping):
        return [(key, value_of(text)) for key, text in changes.items()]
    if isinstance(changes, str):
        changes = [changes]
    if not is_listed(changes):
        raise InputError(f"{said(changes)}: expected key=value, or several of them")
    return [_pair(change) for change in changes]


def value_of(text: Any) -> Any:
    """Return the TOML value of a text; a text that is no TOML stands for itself.

    So 20 ms needs no quotes within quotes.

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


def nested(path: Any, value: Any, python: bool = False) -> dict[str, Any]:
    """Return the tables that hold one value, which is that of a text, or of Python code.

    >>> nested("cameras.eye.size", [320, 240])
    {'cameras': [{'name': 'eye', 'size': [320, 240]}]}
    """
    keys = path.split(".") if isinstance(path, str) else []
    if not _can_be_set(keys):
        example = "task.gain or cameras.NAME.size"
        raise InputError(f"{said(path)} cannot be set; expected a path such as {example}")
    if isinstance(value, dict | list) and not value and keys[-1] not in EMPTY:
        raise InputError(f"{path}: {said(value)} changes nothing; name the value to change")
    tables: Any = Given(value) if python and not isinstance(value, str) else value
    for i in range(len(keys) - 1, -1, -1):
        if i > 0 and keys[i - 1] in NAMED:
            tables = [{NAMED[keys[i - 1]]: keys[i], **tables}]
        else:
            tables = {keys[i]: tables}
    return dict(tables)


def combined(old: Any, new: Any) -> Any:
    """Return tables with those of later changes over them.

    >>> combined({"task": {"gain": 1}}, {"task": {"law": "camera"}})
    {'task': {'gain': 1, 'law': 'camera'}}
    """
    if isinstance(old, Given) and isinstance(new, Mapping):
        return Given(old.value, combined(old.changes or {}, new))
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        return {**old, **{key: combined(old.get(key), each) for key, each in new.items()}}
    if not (isinstance(old, list) and isinstance(new, list)):
        return new
    before, after = ({label(each, i): each for i, each in enumerate(some)} for some in (old, new))
    return list(combined(before, after).values()) if all(isinstance(n, str) for n in after) else new


def _pair(change: Any) -> tuple[str, Any]:
    key, equals, text = change.partition("=") if isinstance(change, str) else ("", "", "")
    if not equals:
        raise InputError(f"{said(change)}: expected key=value, as in task.gain=2")
    return key.strip(), value_of(text.strip())


def _can_be_set(keys: list[str]) -> bool:
    """Return whether keys lead to a value, not to a table, a name, or the schema."""
    whole = bool(keys) and all(keys) and len(keys) <= DEEPEST and keys != ["schema"]
    names = [i + 1 for i, key in enumerate(keys) if key in NAMED]
    renames = len(keys) - 2 in names and keys[-1] == NAMED[keys[-3]]
    return whole and len(keys) - 1 not in names and not renames
