"""Chains as tables of Denavit-Hartenberg rows, as textbooks print them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from robsim.base.decimal_comma import suggest_decimal_point
from robsim.base.errors import InputError, format_value
from robsim.base.si_units import list_units

Cells = dict[str, Any]  # the cells of a row by the constant: theta, d, a, alpha
CONSTANTS = {"theta": "angle", "d": "length", "a": "length", "alpha": "angle"}
OTHER_NAMES = {"θ": "theta", "α": "alpha", "r": "a"}
KINDS = {"R": "revolute", "P": "prismatic"}
MOST_ROWS = 255
EXAMPLE = '["theta (deg)", "d (cm)", "a (cm)", "alpha (deg)"]'
_HEADING = re.compile(r"\s*([^\W\d_]+)(?:_?[in])?\s*(?:[(\[]\s*([^()\[\]]+?)\s*[)\]])?\s*")
_VARIABLE = re.compile(
    r"\s*(?:q|θ|theta|d)_?\d*\*?\s*(?:(?P<sign>[+-])\s*(?P<offset>\d+(?:\.\d*)?|\.\d+)\s*)?", re.I
)
SCHEMA = {
    "dh": {
        "type": "array",
        "minItems": 2,
        "maxItems": MOST_ROWS + 1,
        "items": {"type": "array", "items": {"type": ["number", "string"]}},
        "description": "Chain as a table of DH rows: a row of headings with units, and a row for "
        "each joint.",
    },
    "joints": {
        "type": ["string", "array"],
        "description": 'Kind of each joint of the table `dh`, as "RRP".',
    },
}


def expand_dh_table(raw: Any) -> Any:
    """Return the table of a robot with `links` in place of a table `dh`; other tables unchanged.

    The first row of `dh` has the headings, such as "theta (deg)". A cell with a variable, such as
    "q1 + 90", marks the coordinate of the joint. Raise InputError that names the row and column of
    a wrong cell.

    >>> expand_dh_table({"dh": [["d (cm)", "alpha (deg)"], [10, 90]]})["links"][1]["dh"]
    {'d': '10 cm', 'alpha': '90 deg'}
    """
    if not isinstance(raw, Mapping) or "dh" not in raw:
        if isinstance(raw, Mapping) and "joints" in raw:
            raise InputError(
                "joints: the kinds of the joints belong to a table dh, which is missing"
            )
        return raw
    if "links" in raw:
        raise InputError("dh and links: give one of the two only")
    rows = raw["dh"]
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        raise InputError(
            f"dh: expected a row of headings, as in {EXAMPLE}, and a row for each joint"
        )
    if not 2 <= len(rows) <= MOST_ROWS + 1:
        raise InputError(f"dh: expected headings and 1 to {MOST_ROWS} rows, got {len(rows)} lists")
    columns = _read_headings(rows[0])
    kinds = _read_joint_kinds(raw.get("joints"), len(rows) - 1)
    links: list[dict[str, Any]] = [{"name": "base"}]
    for i, row in enumerate(rows[1:], 1):
        cells, marked = _read_row(row, columns, i)
        kind = kinds[i - 1] if kinds else marked or "revolute"
        if marked and kind != marked:
            raise InputError(
                f"dh: row {i}: the variable belongs to a {marked} joint, and joints has {kind}"
            )
        links.append({"name": f"link{i}", "joint": kind, "dh": cells})
    rest = {key: part for key, part in raw.items() if key not in ("dh", "joints")}
    return {**rest, "links": links}


def convert_chain_schema(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON Schema of a robot with a table `dh` from the schema of one with links."""
    properties = {key: part for key, part in schema["properties"].items() if key != "links"}
    return {**schema, "properties": properties | SCHEMA, "required": ["name", "dh"]}


def _read_headings(row: Sequence[Any]) -> list[tuple[str, str]]:
    """Return the constant and the unit of each column."""
    columns = [_read_heading(cell, k) for k, cell in enumerate(row, 1)]
    names = [name for name, _ in columns]
    if double := next((name for name in names if names.count(name) > 1), ""):
        raise InputError(f"dh: {double} has several columns")
    if not columns:
        raise InputError(f"dh: the first row has no headings; expected {EXAMPLE}")
    return columns


def _read_heading(cell: Any, k: int) -> tuple[str, str]:
    """Return the constant and the unit of a heading such as "theta (deg)"."""
    match = _HEADING.fullmatch(cell) if isinstance(cell, str) and len(cell) < 64 else None
    name = OTHER_NAMES.get(match[1], match[1]) if match else ""
    if match is None or name not in CONSTANTS:
        raise InputError(
            f"dh: column {k} of the headings: {format_value(cell)} is none of "
            f"{', '.join(CONSTANTS)} with a unit, as in {EXAMPLE}"
        )
    units = list_units(CONSTANTS[name])  # type: ignore[arg-type]
    if match[2] not in units:
        given = f"{match[2]!r} is no unit of" if match[2] else "the unit is missing of"
        raise InputError(
            f"dh: column {k} of the headings: {given} {name}; expected one of {', '.join(units)}, "
            f'as in "{name} ({units[-1]})"'
        )
    return name, match[2]


def _read_joint_kinds(joints: Any, count: int) -> list[str]:
    """Return the kind of each joint from letters or names; none if `joints` is missing."""
    if joints is None:
        return []
    names = list(joints) if isinstance(joints, str | list) else []
    kinds = [KINDS.get(name, name) for name in names if isinstance(name, str)]
    if len(names) != count or len(kinds) != count or not set(kinds) <= set(KINDS.values()):
        raise InputError(
            f"joints: expected {count} letters R or P, one for each row of dh, as in "
            f"{format_value('R' * count)}, got {format_value(joints)}"
        )
    return kinds


def _read_row(row: Sequence[Any], columns: list[tuple[str, str]], i: int) -> tuple[Cells, str]:
    """Return the constants of a row, and the kind of joint that its variable marks, or ""."""
    if len(row) != len(columns):
        raise InputError(f"dh: row {i} has {len(row)} cells, and the headings have {len(columns)}")
    cells: Cells = {}
    marked = ""
    for (name, unit), cell in zip(columns, row, strict=True):
        number, is_variable = _read_cell(cell, f"dh: row {i}, column {name}")
        if is_variable and (marked or name not in ("theta", "d")):
            reason = "a second variable" if marked else "a variable, which is theta or d"
            raise InputError(f"dh: row {i}, column {name}: {format_value(cell)} is {reason}")
        if is_variable:
            marked = "revolute" if name == "theta" else "prismatic"
        if number:
            cells[name] = f"{number!r} {unit}"
    return cells, marked


def _read_cell(cell: Any, where: str) -> tuple[float, bool]:
    """Return the number of a cell, and whether the cell has the variable of the joint."""
    if isinstance(cell, str) and (match := _VARIABLE.fullmatch(cell[:64])):
        return float((match["sign"] or "") + (match["offset"] or "0")), True
    number: Any = cell
    if isinstance(cell, str):
        try:
            number = float(cell)
        except ValueError:
            number = None
    if isinstance(number, bool) or not isinstance(number, int | float) or not math.isfinite(number):
        raise InputError(
            f"{where}: expected a number in the unit of the heading, or a variable such as "
            f'"q1 + 90", got {format_value(cell)}{suggest_decimal_point(cell)}'
        )
    return number, False
