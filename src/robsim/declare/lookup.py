"""Dotted names: which there are, which was meant, and what may stand there."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from robsim.declare.fields import Field, fields_of
from robsim.declare.quantities import SI
from robsim.declare.spec import Live, Raw
from robsim.declare.tables import form_of, keys_of

# lists of things with names, and the key of the name
NAMED = {"robots": "name", "objects": "name", "cameras": "name", "motions": "robot"}
NAMED |= {"links": "name", "tools": "name", "phases": "name"}


def as_raw(kind: type[Any], tables: Any, path: str, value: Any) -> Raw:
    """Return how tables of a class hold a Python value at a dotted name.

    A text is what a file would say; a number in SI, an array or an object stands for itself.
    """
    if isinstance(value, str):
        return value
    value = (
        value.item() if isinstance(value, np.generic | np.ndarray) and not np.ndim(value) else value
    )
    plain = isinstance(value, bool | int | float | list | dict)
    spec = spec_at(kind, tables, path) if plain else None
    bare = spec is not None and spec.united and _is_numeric(value)
    return Live(value) if not plain or bare else value


def spec_at(kind: type[Any], tables: Any, path: str, whole: bool = False) -> Any:
    """Return the spec of what has a dotted name; None where it cannot be told.

    With `whole` that of all that may stand there, else of the number that may.
    """
    return _spec_at(kind, tables, path.split("."), whole)


def unit_at(kind: type[Any], tables: Any, path: str) -> str:
    """Return the unit in Python of the numbers at a dotted name; "" where there is none."""
    spec = spec_at(kind, tables, path)
    dimension = getattr(spec, "dimension", None)
    return SI[dimension] if dimension in SI else str(getattr(spec, "unit", ""))


def _is_numeric(value: Any) -> bool:
    if isinstance(value, list):
        return all(map(_is_numeric, value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _spec_at(kind: type[Any], tables: Any, keys: list[str], whole: bool = False) -> Any:
    """Return the spec of what has a dotted name; None where it cannot be told."""
    owner = next((f for f in fields_of(form_of(kind)) if keys[0] in f.spec.keys(f.name)), None)
    if owner is None:
        return None
    if len(keys) == 1:
        own = whole and keys[0] == owner.name
        return owner.spec if own else owner.spec.of_key(owner.name, keys[0])
    inside = tables.get(keys[0]) if isinstance(tables, Mapping) else None
    rest = keys[1:]
    if keys[0] in NAMED:  # of a library robot whose links are not said here there is no table
        some = inside if isinstance(inside, list) else []
        inside = next((t for t in some if t.get(NAMED[keys[0]], t.get("model")) == rest[0]), None)
        rest = rest[1:]
    found = (_spec_at(part, inside, rest, whole) for part in _parts(owner, inside) if rest)
    return next((spec for spec in found if spec is not None), None)


def _parts(owner: Field, inside: Any) -> Iterable[type[Any]]:
    """Return the classes that a field may hold; that of its kind first."""
    return owner.spec.inside_of(inside)


def dotted_names(kind: type[Any], tables: Any, depth: int = 0) -> list[str]:
    """Return the dotted names that tables of a class may have, as far as they say which parts.

    >>> from robsim import IBVS
    >>> "gain" in dotted_names(IBVS, {"kind": "ibvs"})
    True
    """
    found = list(keys_of(kind))
    if depth > 3 or not isinstance(tables, Mapping):
        return found
    for each in fields_of(form_of(kind)):
        inside = tables.get(each.name)
        for part in _parts(each, inside):
            if isinstance(inside, list) and each.name in NAMED:
                for table in inside:
                    name = table.get(NAMED[each.name], table.get("model"))
                    names = dotted_names(part, table, depth + 1)
                    found += [f"{each.name}.{name}.{key}" for key in names]
            elif isinstance(inside, Mapping):
                found += [f"{each.name}.{key}" for key in dotted_names(part, inside, depth + 1)]
            elif inside is None:
                found += [f"{each.name}.{key}" for key in keys_of(part)]
    return list(dict.fromkeys(found))


def nearest(path: str, names: Iterable[str]) -> str:
    """Return the end of a message about an unknown dotted name: what may have been meant."""
    known = list(names)
    leaf = path.rpartition(".")[2]
    meant = [name for name in known if name.rpartition(".")[2] == leaf and name != path]
    meant = meant or difflib.get_close_matches(path[:64], known, 1, 0.5)
    tops = dict.fromkeys(name.partition(".")[0] for name in known)
    guess = f"did you mean {' or '.join(map(repr, meant[:3]))}? " if meant else ""
    return f"{guess}names begin with: {', '.join(tops)}"
