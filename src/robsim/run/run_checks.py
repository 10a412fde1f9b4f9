"""Checks of the arguments of a run."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.protocols import implements
from robsim.declare.spec import add_article
from robsim.engine.recorder import LONGEST
from robsim.servo.tasks.task import ServoTask, Task
from robsim.world.scene import Scene

T = TypeVar("T")


def check_instance(value: object, kind: type[T], what: str) -> T:
    """Return a value if it is an instance of a class; else raise InputError."""
    if not isinstance(value, kind):
        raise InputError(
            f"{what}: expected {add_article(kind.__name__)}, got {format_value(value)}"
        )
    return value


def check_task(value: Any, *kinds: type) -> Any:
    """Return a task of one of the kinds, by default `Task`; InputError for other values."""
    if isinstance(value, ServoTask):  # faster than the test of a protocol
        return value
    if not any(implements(value, kind) for kind in kinds or (Task,)):
        raise InputError(f"task: expected a task such as IBVS(...), got {format_value(value)}")
    return value


def check_starts(scene: Scene, value: Any, what: str) -> Array:
    """Return a start (nq,), or a batch of starts (B, nq); InputError if it is not valid."""
    array = scene.coordinates(value, what)
    if array.ndim > 2 or array.size == 0:
        raise InputError(
            f"{what}: expected shape ({scene.nq},) or (B, {scene.nq}), got {array.shape}"
        )
    return make_read_only(array)


def count_periods(dt: float, duration: float) -> int:
    """Return the number of periods of a duration, at least 1; InputError if out of range."""
    if dt > duration:
        raise InputError(f"dt {dt:g} s is longer than the duration {duration:g} s")
    steps = duration / dt - 1e-9  # infinite if dt is tiny
    if steps > LONGEST:
        raise InputError(
            f"duration {duration:g} s in periods of {dt:g} s are {steps:.3g} steps; "
            "at most 10 million are simulated"
        )
    return max(1, math.ceil(steps))
