"""The servo tasks of which a task is made: those that a switch or an order of tasks holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from robsim.servo import Parallel, Priorities, ServoTask, Switch, Task

Change = Callable[[ServoTask], ServoTask]


def leaves(task: Task) -> list[ServoTask]:
    """In the order in which their errors are stacked; none of a user's own kind of task.

    >>> from robsim import IBVS, PBVS
    >>> [leaf.kind for leaf in leaves(Priorities([PBVS(), IBVS()]))]
    ['pbvs', 'ibvs']
    """
    if isinstance(task, ServoTask):
        return [task]
    return [leaf for part in _parts(task) for leaf in leaves(part)]


def changed(task: Task, change: Change) -> Task:
    """The task with every servo task in it changed."""
    if isinstance(task, ServoTask):
        return change(task)
    if isinstance(task, Switch):
        return replace(task, first=changed(task.first, change), second=changed(task.second, change))
    if isinstance(task, Priorities | Parallel):
        return replace(task, tasks=[changed(part, change) for part in task.tasks])
    return task


def _parts(task: Any) -> list[Task]:
    if isinstance(task, Switch):
        return [task.first, task.second]
    return list(task.tasks) if isinstance(task, Priorities | Parallel) else []
