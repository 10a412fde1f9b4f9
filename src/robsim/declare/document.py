"""Tables for the documentation: what may stand in a table of a text, from the declarations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robsim.declare.fields import Field, fields_of
from robsim.declare.spec import MISSING
from robsim.declare.tables import Table, form_of

GROUPS = ("", "goal", "features", "depth", "law", "weighting", "shaping")


def markdown(kind: type[Any]) -> str:
    """Return a Markdown table of the keys of a class: what each holds, its default, its meaning.

    The fields of a group, which the class that declares them names, stand together.
    """
    form, lines = (
        form_of(kind),
        ["| key | holds | default | meaning |", "| --- | --- | --- | --- |"],
    )
    for name in GROUPS:
        fields = [each for each in fields_of(form) if _group(form, each) == name]
        lines += [f"| **{name}** | | | |"] if name and fields else []
        lines += [f"| {' | '.join(row)} |" for each in fields for row in _rows(each)]
    return "\n".join(lines)


def _group(kind: type[Any], each: Field) -> str:
    """Return the group of a field: the attribute `group` of the class that declares it."""
    owner = next(one for one in kind.__mro__ if each.name in vars(one).get("__annotations__", {}))
    return str(vars(owner).get("group", ""))


def _rows(each: Field) -> Iterator[tuple[str, str, str, str]]:
    if isinstance(each.spec, Table) and each.spec.flat:
        for inner in fields_of(each.spec.declared):
            yield from _rows(inner)
        return
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
