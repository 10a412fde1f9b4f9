"""The servo tasks within a composite task, such as a switch or a list of priorities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

from robsim.servo.tasks.task import ServoTask, Task

TaskChange = Callable[[ServoTask], ServoTask]


def list_servo_tasks(task: Task) -> list[ServoTask]:
    """Return the servo tasks of a task, in the order of their stacked errors.

    >>> from robsim import IBVS, PBVS, Priorities
    >>> [type(leaf).__name__ for leaf in list_servo_tasks(Priorities([PBVS(), IBVS()]))]
    ['PBVS', 'IBVS']
    """
    if isinstance(task, ServoTask):
        return [task]
    parts: Any = getattr(task, "inner", ())
    return [leaf for part in parts for leaf in list_servo_tasks(part)]


def map_servo_tasks(task: Task, change: TaskChange) -> Task:
    """Return the task with the function `change` applied to every servo task in it."""
    if isinstance(task, ServoTask):
        return change(task)
    composite: Any = task
    if not hasattr(composite, "inner"):
        return task
    result: Task = composite.with_inner([map_servo_tasks(part, change) for part in composite.inner])
    return result


def replace_fields(leaf: ServoTask, **values: Any) -> ServoTask:
    """Return a servo task with new values for its fields; names that are no fields are ignored."""
    names = {each.name for each in fields(leaf)}
    known: dict[str, Any] = {name: value for name, value in values.items() if name in names}
    return replace(leaf, **known)


def has_robust_weighting(task: Task) -> bool:
    """Return whether a servo task down-weights outliers among its marks."""
    return any(
        getattr(each, "by_goal", False)
        for leaf in list_servo_tasks(task)
        for each in leaf.weighting
    )
