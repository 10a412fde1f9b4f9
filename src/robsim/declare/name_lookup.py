"""Listing of dotted names, and suggestions for unknown ones."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from dataclasses import is_dataclass
from typing import Any

from robsim.declare.fields import fields_of
from robsim.declare.tables import get_text_form

# lists of named objects, and the key of the name
NAMED = {"robots": "name", "objects": "name", "cameras": "name", "motions": "robot"}
NAMED |= {"links": "name", "tools": "name", "phases": "name"}


def yield_dotted_names(value: Any, depth: int = 0) -> Iterator[str]:
    """Yield the dotted names of the keys of a declared value and of its inner values.

    >>> from robsim import IBVS
    >>> "gain" in yield_dotted_names(IBVS())
    True
    """
    form = get_text_form(type(value))
    for each in fields_of(form) if is_dataclass(form) else ():
        keys = each.spec.keys(each.name)
        yield from keys
        if depth > 3 or each.name not in keys:
            continue
        inside = getattr(value, each.name, None)
        parts = {each.name: inside}
        if isinstance(inside, tuple) and each.name in NAMED:
            parts = {f"{each.name}.{getattr(one, NAMED[each.name])}": one for one in inside}
        for name, one in parts.items():
            yield from (f"{name}.{key}" for key in yield_dotted_names(one, depth + 1))


def suggest_dotted_names(path: str, names: Iterable[str]) -> str:
    """Return the end of a message about an unknown dotted name, with suggestions."""
    known = list(names)
    leaf = path.rpartition(".")[2]
    meant = [name for name in known if name.rpartition(".")[2] == leaf and name != path]
    meant = meant or difflib.get_close_matches(path[:64], known, 1, 0.5)
    tops = dict.fromkeys(name.partition(".")[0] for name in known)
    guess = f"did you mean {' or '.join(map(repr, meant[:3]))}? " if meant else ""
    return f"{guess}names begin with: {', '.join(tops)}"
