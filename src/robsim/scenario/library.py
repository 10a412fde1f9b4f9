"""Robots of the library, as the tables that they stand for."""

from __future__ import annotations

from functools import cache
from typing import Any

from robsim.base.errors import InputError
from robsim.files import robots
from robsim.scenario.belief import merge
from robsim.scenario.problems import Problems, shown, under
from robsim.scenario.text import Raw, parse, read_text


def expanded(tables: Any, problems: Problems, *prefix: str | int) -> Any:
    """A list of robots in which each `model` is replaced by the robot's own tables.

    What else the table says comes over them; without a name the robot has that of its model.
    """
    if not isinstance(tables, list):
        return tables
    made = []
    for i, table in enumerate(tables):
        name = table.get("name", i) if isinstance(table, dict) else i
        with problems.at(*prefix, name if isinstance(name, str) else i):
            made.append(_expanded(table))
    problems.stop()
    return made


def _expanded(table: Any) -> Any:
    if isinstance(table, dict) and isinstance(table.get("tools"), list):
        with under("tools"):
            table = {**table, "tools": [_expanded(tool) for tool in table["tools"]]}
    if not isinstance(table, dict) or "model" not in table:
        return table
    with under("model"):
        if not isinstance(table["model"], str):
            raise InputError(
                f"must be the name of a robot of the library, got {shown(table['model'])}"
            )
        tables = _tables(table["model"])
    return merge(tables, {key: value for key, value in table.items() if key != "model"})


@cache
def _tables(name: str) -> Raw:
    path = robots.file(name)
    tables = parse(read_text(path), str(path))
    return {key: value for key, value in tables.items() if key != "schema"}
