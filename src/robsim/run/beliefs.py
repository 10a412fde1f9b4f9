"""The believed scenes of a task: the scenes as its controllers model them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robsim.base.value import replace_unchecked
from robsim.declare.fields import is_identical
from robsim.servo.nested_tasks import list_servo_parts, replace_servo_tasks
from robsim.world.scene import Scene


def find_common_belief(task: Any) -> Scene | None:
    """Return the common belief of the servo tasks in a task; None without a common belief."""
    each = list_beliefs(task)
    return each[0] if each and all(is_identical(one, each[0]) for one in each) else None


def list_beliefs(task: Any) -> list[Scene | None]:
    """Return the belief of each servo task within a task; None is the true scene."""
    return [each.belief for each in list_servo_parts(task)]


def replace_beliefs(task: Any, change: Callable[[Scene | None], Scene | None]) -> Any:
    """Return a copy of a task with the belief of every inner task replaced by `change`."""
    changes = {id(one): (one, change(one)) for one in list_beliefs(task)}
    if all(new is old for old, new in changes.values()):
        return task
    return replace_servo_tasks(
        task, lambda servo: replace_unchecked(servo, belief=changes[id(servo.belief)][1])
    )
