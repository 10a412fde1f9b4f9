"""Markdown tables of the keys of declared classes, for the documentation."""

from __future__ import annotations

from collections.abc import Iterator

from robsim.declare.context import MISSING
from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.spec import DeclaredClass
from robsim.declare.tables import Table, get_text_form

GROUPS = ("", "goal", "features", "depth", "law", "weighting", "shaping")


def format_markdown_table(kind: DeclaredClass) -> str:
    """Return a Markdown table of the keys of a class: type, default and meaning of each.

    The fields of a group are placed together; the declaring class names the group.
    """
    form = get_text_form(kind)
    lines = ["| key | holds | default | meaning |", "| --- | --- | --- | --- |"]
    for name in GROUPS:
        fields = [each for each in fields_of(form) if _get_field_group(form, each) == name]
        lines += [f"| **{name}** | | | |"] if name and fields else []
        lines += [f"| {' | '.join(row)} |" for each in fields for row in _format_field_rows(each)]
    return "\n".join(lines)


def _get_field_group(kind: DeclaredClass, each: DeclaredField) -> str:
    """Return the group of a field: the attribute `group` of the class that declares it."""
    field = kind.__dataclass_fields__[each.name]
    for owner in map(vars, reversed(kind.__mro__)):  # a class that declares it anew has another
        if owner.get("__dataclass_fields__", {}).get(each.name) is field:
            return str(owner.get("group", ""))
    return ""


def _format_field_rows(each: DeclaredField) -> Iterator[tuple[str, str, str, str]]:
    if isinstance(each.spec, Table) and each.spec.flat:
        for inner in fields_of(each.spec.declared):
            yield from _format_field_rows(inner)
        return
    for i, (key, holds) in enumerate(each.spec.rows(each.name)):
        default = "" if i else _format_default(each)
        yield f"`{key}`", _escape_cell(holds), default, _escape_cell("" if i else each.meaning)


def _format_default(each: DeclaredField) -> str:
    if each.default is MISSING:
        return "required"
    if each.default is None or each.default == ():
        return ""
    return _escape_cell(f"`{each.default}`")


def _escape_cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
