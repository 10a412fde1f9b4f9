"""The believed scenes of a task: the scenes as its controllers model them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from robsim.base.value import replace_unchecked
from robsim.declare.fields import is_identical
from robsim.world.scene import Scene


def find_common_belief(task: Any) -> Scene | None:
    """Return the common belief of the servo tasks in a task; None without a common belief."""
    each = list_beliefs(task)
    return each[0] if each and all(is_identical(one, each[0]) for one in each) else None


def list_beliefs(task: Any) -> list[Scene | None]:
    """Return the belief of each servo task within a task; None is the true scene."""
    if hasattr(task, "inner"):
        return [belief for each in task.inner for belief in list_beliefs(each)]
    return [task.belief] if hasattr(task, "belief") else []


def replace_beliefs(task: Any, change: Callable[[Scene | None], Scene | None]) -> Any:
    """Return a copy of a task with the belief of every inner task replaced by `change`."""
    changes = {id(one): (one, change(one)) for one in list_beliefs(task)}
    is_same = all(new is old for old, new in changes.values())
    return task if is_same else _replace_nested_beliefs(task, changes)


def _replace_nested_beliefs(task: Any, changes: Mapping[int, tuple[Any, Any]]) -> Any:
    """Return a task, or a part of one, with the replaced beliefs of all its parts."""
    if isinstance(task, tuple):
        return tuple(_replace_nested_beliefs(each, changes) for each in task)
    if hasattr(task, "belief"):
        return replace_unchecked(task, belief=changes[id(task.belief)][1])
    if not any(hasattr(task, name) for name in ("inner", "task")):
        return task
    own = {each.name: getattr(task, each.name) for each in fields(task)}
    parts = {name: _replace_nested_beliefs(value, changes) for name, value in own.items()}
    return replace_unchecked(task, **parts)
