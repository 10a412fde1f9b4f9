"""The fields of an experiment that a text says, or that changes by name make of another one."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import InputError
from robsim.declare.lookup import dotted_names, nearest
from robsim.declare.problems import Problems
from robsim.declare.tables import keys_of
from robsim.files.changes import Changes, combined, nested, pairs
from robsim.files.toml import Tables, parse
from robsim.run.text import ExperimentTable, read_experiment, task_table

TOP = keys_of(ExperimentTable)


def read(text: str, source: str) -> dict[str, Any]:
    """Return the fields of the experiment of a TOML text."""
    tables = parse(text, source)
    return {**read_experiment(tables, source), "study": tables.get("study")}


def pairs_of(changes: Changes, source: str) -> list[tuple[str, Any]]:
    """Return the dotted names and values of changes; FileError for a change that is none."""
    problems = Problems(source)
    found: list[tuple[str, Any]] = []
    with problems.at():
        found = pairs(changes)
    problems.stop()
    return found


def changed(
    experiment: Any, changes: list[tuple[str, Any]], python: bool = False
) -> dict[str, Any]:
    """Return the fields of an experiment in which dotted names have other values.

    A value is that of a text; in `python` a number is in SI, and an object stands for itself.
    FileError: no such name, or no such value.
    """
    tables, study = _tables(experiment, changes, python), experiment.study
    if "study" in tables:
        study = combined(study or {}, tables["study"])
    return {**read_experiment(tables, experiment.source, experiment), "study": study}


def _tables(experiment: Any, changes: list[tuple[str, Any]], python: bool) -> Tables:
    """Return the tables that say all changes; FileError for a name that there cannot be."""
    problems, tables = Problems(experiment.source), dict[str, Any]()
    with problems.at():
        for path, value in changes:
            over = nested(path, value, python)
            if next(iter(over)) not in TOP:
                names = [*dotted_names(task_table(experiment)), *dotted_names(experiment.scene)]
                raise InputError(f"{path}: there is no such name; {nearest(path, names)}")
            tables = combined(tables, over)
    problems.stop()
    return tables
