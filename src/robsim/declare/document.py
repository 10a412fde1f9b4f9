"""Tables for the documentation: what may stand in a table of a text, from the declarations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robsim.declare.fields import Field, fields_of
from robsim.declare.spec import MISSING
from robsim.declare.tables import form_of


def markdown(kind: type[Any]) -> str:
    """Return a Markdown table of the keys of a class: what each holds, its default, its meaning."""
    rows = [row for each in fields_of(form_of(kind)) for row in _rows(each)]
    head = ["| key | holds | default | meaning |", "| --- | --- | --- | --- |"]
    return "\n".join([*head, *(f"| {' | '.join(row)} |" for row in rows)])


def _rows(each: Field) -> Iterator[tuple[str, str, str, str]]:
    for i, (key, holds) in enumerate(each.spec.rows(each.name)):
        default = "" if i else _default(each)
        yield f"`{key}`", _cell(holds), default, _cell("" if i else each.meaning)


def _default(each: Field) -> str:
    if each.default is MISSING:
        return "required"
    if each.default is None or each.default == ():
        return ""
    return _cell(f"`{each.default}`")


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
