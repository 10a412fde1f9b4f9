"""Tables of an experiment in which dotted names have other values."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

from robsim.base.errors import InputError
from robsim.declare.lookup import as_raw, dotted_names, nearest
from robsim.declare.problems import Problems
from robsim.declare.spec import Live
from robsim.declare.tables import merge_table
from robsim.files.changes import Changes, nested, pairs
from robsim.files.toml import Tables
from robsim.run.text import ExperimentTable


def changed(tables: Tables, changes: Changes, source: str, python: bool = False) -> Tables:
    """Return tables with every change made; values are those of a text or of `python`.

    FileError: no such name, or not a change.
    """
    problems = Problems(source)
    with problems.at():
        for path, value in pairs(changes):
            if python and _is_of_own_task(tables, path, value):
                tables = _with_own_task(tables, path, value)
                continue
            raw = as_raw(ExperimentTable, tables, path, value) if python else value
            over = nested(path, raw)
            if next(iter(over)) not in _TOP:
                names = dotted_names(ExperimentTable, tables)
                raise InputError(f"{path}: there is no such name; {nearest(path, names)}")
            tables = merge_table(ExperimentTable, tables, over, False)
    problems.stop()
    nothing = any(value is None for _, value in pairs(changes))
    return _without_none(tables) if nothing else tables


def _is_of_own_task(tables: Tables, path: str, value: Any) -> bool:
    """Return whether a path names a field of a task of a class that no text knows."""
    task, (top, _, key) = tables.get("task"), path.partition(".")
    if not isinstance(task, Live) or not is_dataclass(task.value) or top != "task":
        return False
    return value is not None and any(each.name == key for each in fields(task.value))


def _with_own_task(tables: Tables, path: str, value: Any) -> Tables:
    """Return tables whose task, of a class that no text knows, has another value in a field."""
    task, key = tables["task"], path.partition(".")[2]
    gone = {"belief"} & {key}  # that of the experiment, which is that of its task
    kept = {name: each for name, each in tables.items() if name not in gone}
    return {**kept, "task": Live(replace(task.value, **{key: value}))}


def _without_none(tables: Any) -> Any:
    """Return the tables without the keys whose value is None: as if nothing was said."""
    if isinstance(tables, list):
        return [_without_none(each) for each in tables]
    if not isinstance(tables, dict):
        return tables
    said = {k: x for k, x in tables.items() if not (isinstance(x, Live) and x.value is None)}
    return {key: _without_none(x) for key, x in said.items()}


def names_files(tables: Any) -> bool:
    """Return whether a robot or a tool, also a believed one, is that of a URDF file."""
    parts = tables.values() if isinstance(tables, dict) else tables
    if not isinstance(tables, dict | list):
        return False
    return "urdf" in tables or any(names_files(part) for part in parts)


def has_objects(tables: Any) -> bool:
    parts = tables.values() if isinstance(tables, dict) else tables
    if not isinstance(tables, dict | list):
        return isinstance(tables, Live)
    return any(has_objects(part) for part in parts)


_TOP = {each.name for each in fields(ExperimentTable)}
