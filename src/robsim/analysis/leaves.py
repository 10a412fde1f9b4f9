"""The servo tasks of which a task is made: those that a switch or an order of tasks holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robsim.servo import ServoTask, Task

Change = Callable[[ServoTask], ServoTask]


def leaves(task: Task) -> list[ServoTask]:
    """Return the servo tasks in the order in which their errors are stacked.

    >>> from robsim import IBVS, PBVS, Priorities
    >>> [type(leaf).__name__ for leaf in leaves(Priorities([PBVS(), IBVS()]))]
    ['PBVS', 'IBVS']
    """
    if isinstance(task, ServoTask):
        return [task]
    inner: Any = getattr(task, "inner", ())
    return [leaf for part in inner for leaf in leaves(part)]


def changed(task: Task, change: Change) -> Task:
    """Return the task with every servo task in it changed."""
    if isinstance(task, ServoTask):
        return change(task)
    if not hasattr(task, "inner"):
        return task
    made: Task = task.with_inner([changed(part, change) for part in task.inner])
    return made
