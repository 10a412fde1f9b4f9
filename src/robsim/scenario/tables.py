"""From raw tables to the models of the schema, and pydantic's complaints in our words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from robsim.base.errors import suggest
from robsim.scenario.problems import SHOWN, Problems, joined, shown
from robsim.scenario.schema import Table
from robsim.scenario.task_schema import ScenarioFile

M = TypeVar("M", bound=Table)
Location = tuple[str | int, ...]
_MISSING = "missing, and it must be given"
_PHRASES = (
    ("Input should", "must"),
    ("List should", "must"),
    ("String should", "must"),
    (" after validation", ""),
)


def checked(model: type[M], raw: Mapping[str, Any], problems: Problems, *prefix: str | int) -> M:
    """The model of raw tables; FileError with all that is wrong."""
    made = None
    try:
        made = model.model_validate(raw)
    except ValidationError as error:
        entries = error.errors(include_url=False)
        problems.untold += len(entries[SHOWN:])
        for entry in entries[:SHOWN]:
            location, value = _place(raw, entry)
            text = _text(model, entry, location, value)
            problems.add(joined(*prefix, *named(raw, location)), text)
    return problems.settled(made)


def named(raw: Any, location: Location) -> Iterator[str | int]:
    """The steps of a location, with the names of tables in place of their numbers."""
    for step in location:
        raw = _inside(raw, step)
        table = raw if isinstance(step, int) and isinstance(raw, dict) else {}
        name = table.get("name", table.get("robot"))
        yield name if isinstance(name, str) and name else step


def _place(raw: Any, entry: Any) -> tuple[Location, Any]:
    """A location without the tags that pydantic puts between its steps, and what is there."""
    steps: list[str | int] = []
    no_kind = entry["type"].startswith("union_tag")
    loc = (*entry["loc"], "kind") if no_kind else entry["loc"]
    lacking = no_kind or entry["type"] == "missing"
    for i, step in enumerate(loc):
        missing = lacking and i == len(loc) - 1 and isinstance(raw, dict)
        if missing or _inside(raw, step) is not None:
            steps.append(step)
            raw = _inside(raw, step)
    return tuple(steps), raw


def _inside(raw: Any, step: str | int) -> Any:
    if isinstance(raw, dict) and isinstance(step, str):
        return raw.get(step)
    if isinstance(raw, list) and isinstance(step, int) and step < len(raw):
        return raw[step]
    return None


def _text(model: type[Table], entry: Any, location: Location, value: Any) -> str:
    """One complaint: what is wrong, what was given, what would be valid."""
    kind, key, given = entry["type"], str(location[-1]), f"got {shown(value)}"
    if kind == "extra_forbidden":
        keys = keys_at(model, entry["loc"][:-1])
        return f"unknown key {shown(key)}; {suggest(key[:64], keys, 'keys')}"
    if kind == "value_error":
        return str(entry["ctx"]["error"])
    if kind == "list_type" and isinstance(value, dict):
        return f"must be a list of tables, [[{key}]], {given}"
    if kind == "union_tag_not_found":
        kinds = [name for table in tables_at(model, entry["loc"]) for name in _kinds(table)]
        return f"{_MISSING}; kinds: {', '.join(map(repr, dict.fromkeys(kinds)))}"
    if kind == "union_tag_invalid":
        kinds = entry["ctx"]["expected_tags"].replace("'", "").split(", ")
        return f"no kind {shown(value)}; {suggest(entry['ctx']['tag'][:64], kinds, 'kinds')}"
    return _MISSING if kind == "missing" else f"{_reworded(entry['msg'])}, {given}"


def _reworded(message: str) -> str:
    for theirs, ours in _PHRASES:
        message = message.replace(theirs, ours)
    theirs = r"valid dictionary or (instance of \w+|object to extract fields from)"
    return re.sub(theirs, "table", message)


def keys_at(model: type[Table], location: Location) -> list[str]:
    """The keys that a table at this location may have."""
    tables = tables_at(model, location)
    return list(dict.fromkeys(key for table in tables for key in _keys(table)))


def tables_at(model: type[Table], location: Location) -> list[type[Table]]:
    """The tables that may stand at this location."""
    tables: list[type[Table]] = [model]
    for step in location:
        fields = [t.model_fields[step] for t in tables if step in t.model_fields]
        kinds = [t for t in tables if step in _kinds(t)]
        if kinds:
            tables = kinds
        elif fields:
            tables = [t for field in fields for t in _tables(field.annotation)]
    return tables


def _keys(table: type[Table]) -> list[str]:
    return [field.alias or name for name, field in table.model_fields.items()]


def _kinds(table: type[Table]) -> tuple[str, ...]:
    field = table.model_fields.get("kind")
    return get_args(field.annotation) if field else ()


def _tables(annotation: Any) -> list[type[Table]]:
    """The tables inside an annotation such as list[Annotated[A | B, ...]] | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation] if issubclass(annotation, Table) else []
    return [table for part in get_args(annotation) for table in _tables(part)]


def _all_within(table: type[Table], found: set[type[Table]]) -> set[type[Table]]:
    """A table and all that may stand in it."""
    if table not in found:
        found.add(table)
        for field in table.model_fields.values():
            for each in _tables(field.annotation):
                _all_within(each, found)
    return found


# of each kind of thing its keys
KINDS = {k: set(_keys(table)) for table in _all_within(ScenarioFile, set()) for k in _kinds(table)}
