"""The scenes that the tasks within a task believe in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

from robsim.base.values import unchecked
from robsim.declare.fields import same
from robsim.world.scene import Scene


def common_belief(task: Any) -> Scene | None:
    """Return the belief of all servo tasks within a task; None if none has one, or they differ."""
    each = beliefs(task)
    return each[0] if each and all(same(one, each[0]) for one in each) else None


def beliefs(task: Any) -> list[Scene | None]:
    """Return the belief of each servo task within a task; None stands for the truth."""
    if hasattr(task, "inner"):
        return [belief for each in task.inner for belief in beliefs(each)]
    return [task.belief] if hasattr(task, "belief") else []


def with_beliefs(task: Any, change: Callable[[Scene | None], Scene | None]) -> Any:
    """Return a task, all tasks within which have another belief."""
    made = {id(one): (one, change(one)) for one in beliefs(task)}
    return task if all(new is old for old, new in made.values()) else _within(task, made)


def _within(task: Any, made: Mapping[int, tuple[Any, Any]]) -> Any:
    """Return a task, or a part of one, with all that is within it."""
    if isinstance(task, tuple):
        return tuple(_within(each, made) for each in task)
    if hasattr(task, "belief"):
        return unchecked(task, belief=made[id(task.belief)][1])
    if not any(hasattr(task, name) for name in ("inner", "task")):
        return task
    own = {each.name: getattr(task, each.name) for each in fields(task)}
    return unchecked(task, **{name: _within(value, made) for name, value in own.items()})
