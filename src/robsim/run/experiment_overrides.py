"""The fields of an experiment from a text, or from changes to another experiment."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import InputError
from robsim.declare.name_lookup import suggest_dotted_names, yield_dotted_names
from robsim.declare.problems import Problems
from robsim.declare.tables import get_table_keys
from robsim.files.overrides import Changes, merge_tables, nest_value, parse_changes
from robsim.files.toml import Tables, parse_toml
from robsim.run.experiment_text import ExperimentTable, make_task_table, read_experiment

TOP = get_table_keys(ExperimentTable)


def read_experiment_text(text: str, source: str, **facts: Any) -> dict[str, Any]:
    """Return the fields of the experiment of a TOML text; `facts` are those of its reader."""
    tables = parse_toml(text, source)
    return {**read_experiment(tables, source, **facts), "study": tables.get("study")}


def parse_dotted_changes(changes: Changes, source: str) -> list[tuple[str, Any]]:
    """Return the dotted names and values of changes; FileError for an invalid change."""
    problems = Problems(source)
    pairs: list[tuple[str, Any]] = []
    with problems.at():
        pairs = parse_changes(changes)
    problems.stop()
    return pairs


def apply_changes(
    experiment: Any, changes: list[tuple[str, Any]], python: bool = False
) -> dict[str, Any]:
    """Return the fields of an experiment with other values at dotted names.

    Values are parsed as in a text. With `python`, numbers are in SI units and objects are taken as
    they are, and errors do not name the file. Raise InputError, or FileError for a text, if a name
    does not exist, or if a value is not valid.
    """
    tables, study = _make_change_tables(experiment, changes, python), experiment.study
    if "study" in tables:
        study = merge_tables(study or {}, tables["study"])
    return {**read_experiment(tables, experiment.source, experiment, not python), "study": study}


def _make_change_tables(experiment: Any, changes: list[tuple[str, Any]], python: bool) -> Tables:
    """Return the tables of all changes; InputError for a name that cannot exist."""
    problems, tables = Problems("" if python else experiment.source), dict[str, Any]()
    with problems.at():
        for path, value in changes:
            over = nest_value(path, value, python)
            if next(iter(over)) not in TOP:
                names = [
                    *yield_dotted_names(make_task_table(experiment)),
                    *yield_dotted_names(experiment.scene),
                ]
                raise InputError(
                    f"{path}: there is no such name; {suggest_dotted_names(path, names)}"
                )
            tables = merge_tables(tables, over)
    problems.stop()
    return tables
