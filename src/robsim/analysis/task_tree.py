"""The servo tasks within a task, such as those of a switch or of a list of priorities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

from robsim.servo.tasks.task import ServoTask, Task

TaskChange = Callable[[ServoTask], ServoTask]


def list_servo_tasks(task: Task) -> list[ServoTask]:
    """Return the servo tasks in the order in which their errors are stacked.

    >>> from robsim import IBVS, PBVS, Priorities
    >>> [type(leaf).__name__ for leaf in list_servo_tasks(Priorities([PBVS(), IBVS()]))]
    ['PBVS', 'IBVS']
    """
    if isinstance(task, ServoTask):
        return [task]
    inner: Any = getattr(task, "inner", ())
    return [leaf for part in inner for leaf in list_servo_tasks(part)]


def map_servo_tasks(task: Task, change: TaskChange) -> Task:
    """Return the task with `change` applied to every servo task in it."""
    if isinstance(task, ServoTask):
        return change(task)
    outer: Any = task
    if not hasattr(outer, "inner"):
        return task
    made: Task = outer.with_inner([map_servo_tasks(part, change) for part in outer.inner])
    return made


def replace_fields(leaf: ServoTask, **values: Any) -> ServoTask:
    """Return a servo task with other values of those of these fields that it has."""
    own = {each.name for each in fields(leaf)}
    given: dict[str, Any] = {name: value for name, value in values.items() if name in own}
    return replace(leaf, **given)


def has_robust_weighting(task: Task) -> bool:
    """Return whether marks that are far from where the others are count less in some servo task."""
    return any(
        getattr(each, "by_goal", False)
        for leaf in list_servo_tasks(task)
        for each in leaf.weighting
    )
