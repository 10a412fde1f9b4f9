"""The family of tasks, and how a text declares a task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robsim.base.errors import InputError
from robsim.declare import KindOf, family
from robsim.declare.context import Context, Raw
from robsim.declare.joint_numbers import Axes, check_deferred_numbers
from robsim.declare.problems import UnreadableValue

TASKS = family("task")
MAX_NESTING = 16  # levels of nested tasks
MAX_SCHEMES = 64  # innermost tasks in one task
MAX_TASKS = 1100  # tasks in one text, in all phases and levels
NESTING_MESSAGE = f"tasks are nested more than {MAX_NESTING} deep"


@dataclass(frozen=True)
class TaskChoice(KindOf):
    """Choice of a task; numbers for its joints are checked once the commanded joints are known.

    A class with the attribute `outermost`, such as a mission, is not allowed inside another task;
    it is allowed if `whole` is true.
    """

    short: bool = False
    whole: bool = False

    @property
    def names(self) -> list[str]:
        """Names of the allowed kinds."""
        find = self.family.find
        return [
            name for name in super().names if self.whole or not hasattr(find(name), "outermost")
        ]

    def check(self, value: Any, what: str) -> Any:
        if not self.whole and hasattr(value, "outermost"):
            raise InputError(f"{what}: a {type(value).__name__} cannot be part of another task")
        return super().check(value, what)

    def read(self, raw: Raw, c: Context) -> Any:
        later: list[Any] = []
        task = super().read(raw, _count_task(c).with_facts(later=later))
        if later and c.facts.get("scene") is not None:
            before = c.problems.total_count
            try:
                check_deferred_numbers(later, describe_commanded_axes(task, c.facts["scene"]))
            except InputError as error:
                later[0][2].blame(error)
            if c.problems.total_count > before:
                raise UnreadableValue
        return task

    def write(self, value: Any, c: Context) -> Raw:
        def commanded() -> Axes:
            return describe_commanded_axes(value, c.facts["scene"])

        return super().write(value, c.with_facts(commanded=commanded))


def _count_task(c: Context) -> Context:
    """Return the context of one more task; raise InputError if the text has too many tasks."""
    count, depth = c.facts.get("count", []), c.facts.get("depth", 0)
    count.append(c.path)
    if len(count) > MAX_TASKS + 1:  # reported already
        raise UnreadableValue
    if len(count) > MAX_TASKS:
        raise InputError(f"more than {MAX_TASKS} tasks, nested tasks included")
    if depth > MAX_NESTING:
        raise InputError(NESTING_MESSAGE)
    return c.with_facts(count=count, depth=depth + 1)


def check_nesting(task: Any) -> None:
    """Raise InputError if a task contains too many tasks, or too many levels of tasks."""
    level, depth, schemes = [task], 0, 0
    while level:
        depth += 1
        if depth > MAX_NESTING:
            raise InputError(NESTING_MESSAGE)
        inner = [each.inner for each in level if hasattr(each, "inner")]
        schemes += len(level) - len(inner)
        level = [task for several in inner for task in several]
        if schemes + len(level) > MAX_SCHEMES:
            raise InputError(f"composed of more than {MAX_SCHEMES} tasks")


def describe_commanded_axes(task: Any, scene: Any) -> Axes:
    """Return the units and names of the velocities that a task commands."""
    columns = task.columns(scene)
    units = [scene.velocity_units[i] for i in columns]
    return Axes(units, [scene.velocity_names[i] for i in columns])
