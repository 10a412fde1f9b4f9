"""Replacement of the servo tasks within a task, at any depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

from robsim.base.value import replace_unchecked


def replace_servo_tasks(task: Any, change: Callable[[Any], Any]) -> Any:
    """Return a task with every servo task in it replaced by `change`, at any depth.

    A servo task is an object with a belief. The result is the task itself if nothing changes.
    """
    if isinstance(task, tuple):
        parts = tuple(replace_servo_tasks(each, change) for each in task)
        return task if _are_same(parts, task) else parts
    if hasattr(task, "belief"):
        return change(task)
    if not any(hasattr(task, name) for name in ("inner", "task")):
        return task
    own = {each.name: getattr(task, each.name) for each in fields(task)}
    changed = {name: replace_servo_tasks(value, change) for name, value in own.items()}
    if _are_same(tuple(changed.values()), tuple(own.values())):
        return task
    return replace_unchecked(task, **changed)


def _are_same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    return all(a is b for a, b in zip(one, other, strict=True))


def list_servo_parts(task: Any) -> list[Any]:
    """Return the servo tasks within a task, at any depth."""
    if hasattr(task, "inner"):
        return [servo for each in task.inner for servo in list_servo_parts(each)]
    return [task] if hasattr(task, "belief") else []
