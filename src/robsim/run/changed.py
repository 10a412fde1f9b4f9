"""The fields of an experiment that a text says, or another experiment, with changes by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from robsim.base.errors import InputError
from robsim.declare.lookup import as_raw, dotted_names, nearest
from robsim.declare.problems import Problems
from robsim.declare.spec import Live
from robsim.declare.tables import merge_table
from robsim.files.changes import Changes, nested, pairs
from robsim.files.toml import Tables, parse
from robsim.run.brief import brief_tables
from robsim.run.text import ExperimentTable, read_experiment, write_experiment


def read(text: str, source: str, set: Changes = ()) -> dict[str, Any]:
    """Return the fields of the experiment of a TOML text, with changes such as ["task.gain=2"]."""
    return _read(_changed(parse(text, source), pairs_of(set, source), source), source)


def changed(experiment: Any, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of an experiment of whose text dotted names have other values.

    A number is in SI, a text is what a file says, an object stands for itself. FileError: no such
    name, or no such value.
    """
    source = experiment.source
    tables = brief_tables(experiment, Path(source).parent, live=True)
    if not _says(tables, experiment):
        tables = write_experiment(experiment, live=True)
    if experiment.study is not None:
        tables["study"] = experiment.study
    return _read(_changed(tables, pairs(changes), source, python=True), source)


def _says(tables: Tables, experiment: Any) -> bool:
    """Return whether tables are read as an experiment."""
    with suppress(InputError):
        return bool(type(experiment)(**_read(tables, experiment.source)) == experiment)
    return False


def _read(tables: Tables, source: str) -> dict[str, Any]:
    return {**read_experiment(tables, source), "study": tables.get("study")}


def pairs_of(set: Changes, source: str) -> list[tuple[str, Any]]:
    """Return the dotted names and values of changes; FileError for what is none."""
    problems = Problems(source)
    found: list[tuple[str, Any]] = []
    with problems.at():
        found = pairs(set)
    problems.stop()
    return found


def _changed(
    tables: Tables, changes: Sequence[tuple[str, Any]], source: str, python: bool = False
) -> Tables:
    """Return tables with every change made; values are those of a text or of `python`."""
    problems = Problems(source)
    with problems.at():
        for path, value in changes:
            if python and _is_of_own_task(tables, path, value):
                tables = _with_own_task(tables, path, value)
                continue
            over = nested(path, as_raw(ExperimentTable, tables, path, value) if python else value)
            if next(iter(over)) not in _TOP:
                names = dotted_names(ExperimentTable, tables)
                raise InputError(f"{path}: there is no such name; {nearest(path, names)}")
            tables = merge_table(ExperimentTable, tables, over, False)
    problems.stop()
    return _without_none(tables) if any(value is None for _, value in changes) else tables


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


_TOP = {each.name for each in fields(ExperimentTable)}
