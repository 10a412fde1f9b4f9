"""Tables over tables: a belief over the truth, a robot over the library's, a change over a file.

Tables merge key by key and lists of named tables name by name; anything else is replaced.
"""

from __future__ import annotations

from typing import Any

from robsim.base.errors import InputError, suggest
from robsim.scenario.problems import shown, under
from robsim.scenario.tables import KINDS
from robsim.scenario.text import Raw

NAMED = ("robots", "objects", "cameras", "motions", "links", "tools")
_INTRINSICS = ({"K"}, {"focal", "center", "skew"})
_RIVALS = (
    ({"rpy"}, {"rotvec"}, {"rotation"}),
    ({"dh"}, {"place", "tail"}),
    ({"q"}, {"computed"}, {"s"}, {"position", "rpy", "rotvec", "rotation"}),
    _INTRINSICS,
)
# a key, its one value beside which a companion makes sense, and that companion
_COMPANIONS = (
    ("law", "camera", "length"),
    ("inverse", "pseudo_inverse", "rcond"),
    ("inverse", "damped", "damping"),
    ("feed_forward", "estimated", "lag"),
    ("interaction", "broyden", "broyden_start"),
)


def merge(base: Raw, over: Raw, partial: bool = False) -> Raw:
    """`over` over `base`; both stay as they are.

    A key replaces other spellings of the same (`rpy` a `rotation`, `dh` a `place`) and what makes
    no sense beside it (`law = "joint"` a `length`, another `kind` what that kind lacks). With
    `partial`, `base` is itself only a list of changes, to which new names may be added.

    >>> merge({"task": {"gain": 1, "law": "joint"}}, {"task": {"gain": 2}})
    {'task': {'gain': 2, 'law': 'joint'}}
    """
    merged = _without_rivals(base, over)
    for key, new in over.items():
        old = merged.get(key)
        loose = partial or key == "belief" or "model" in base
        if isinstance(old, dict) and isinstance(new, dict):
            merged[key] = merge(old, new, loose)
        elif key == "tasks" and isinstance(old, list) and isinstance(new, dict):
            with under(key):
                merged[key] = _merge_numbered(old, new, loose)
        elif key in NAMED and isinstance(old, list) and isinstance(new, list):
            with under(key):
                merged[key] = _merge_named(old, new, key, loose)
        else:
            merged[key] = new
    return merged


def name_of(table: Any) -> str | None:
    """The name of a table; a library robot without one has that of its model.

    A motion has that of its robot.
    """
    given = table if isinstance(table, dict) else {}
    name = next((given[key] for key in ("name", "model", "robot") if key in given), None)
    return name if isinstance(name, str) else None


def name_key(kind: str) -> str:
    """The key under which things of this kind have their name."""
    return "robot" if kind == "motions" else "name"


def _merge_named(old: list[Any], new: list[Any], kind: str, partial: bool) -> list[Any]:
    where: dict[str | None, int] = {}
    for i, table in enumerate(old):
        where.setdefault(name_of(table), i)
    merged = list(old)
    for number, table in enumerate(new):
        name = name_of(table)
        if name is None:
            with under(number):
                raise InputError(f"needs the name of what it changes, got {shown(table)}")
        if name in where and isinstance(old[where[name]], dict):
            i = where[name]
            with under(name):
                merged[i] = merge(merged[i], table, partial)
        elif partial:
            merged.append(table)
        else:
            names = [n for n in where if n is not None]
            with under(name):
                raise InputError(f"there is none to change; {suggest(name[:64], names, kind)}")
    return merged


def _merge_numbered(old: list[Any], new: Raw, partial: bool) -> list[Any]:
    """Tasks have no names: task.tasks.0.gain is the gain of the first."""
    merged = list(old)
    for number, table in new.items():
        if not number.isdecimal() or int(number) >= len(old):
            with under(number):
                raise InputError(f"there is no such task; they are numbered 0 to {len(old) - 1}")
        i = int(number)
        with under(i):
            merged[i] = merge(merged[i], table, partial) if isinstance(table, dict) else table
    return merged


def _without_rivals(base: Raw, over: Raw) -> Raw:
    """A copy of `base` without other spellings of what `over` says."""
    merged = _spelled_out(base) if _INTRINSICS[1] & over.keys() else dict(base)
    gone = {
        companion for key, value, companion in _COMPANIONS if key in over and over[key] != value
    }
    old, new = (KINDS.get(str(table.get("kind"))) for table in (base, over))
    if old and new:
        strangers = {companion for key, _, companion in _COMPANIONS if key in new - old}
        gone |= (old - new) | strangers  # which there meant something else
    for group in _RIVALS:
        for spelling in group:
            if spelling & over.keys():
                gone |= set().union(*group) - spelling
    return {key: value for key, value in merged.items() if key not in gone}


def _spelled_out(camera: Raw) -> Raw:
    """A camera's K as focal, center and skew, so that one of them can change alone."""
    try:
        (fx, skew, cx), (_, fy, cy), _ = camera["K"]
    except (KeyError, TypeError, ValueError):
        return dict(camera)
    rest = {key: value for key, value in camera.items() if key != "K"}
    return {**rest, "focal": [fx, fy], "center": [cx, cy], "skew": skew}
