"""The family of tasks, and how a text says one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robsim.base.errors import InputError
from robsim.declare import KindOf, family
from robsim.declare.joint_numbers import Axes, check_deferred_numbers
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import Context, Raw

TASKS = family("task")
MAX_NESTING = 16  # tasks within each other
MAX_SCHEMES = 64  # tasks without tasks in them, in one
MAX_TASKS = 1100  # of a text: those of all phases, and tasks within them
NESTING_MESSAGE = f"tasks are nested more than {MAX_NESTING} deep"


@dataclass(frozen=True)
class TaskChoice(KindOf):
    """A task, whose numbers of joints are checked once it is known which joints it commands.

    Kinds whose class says `outermost`, such as a mission, are no part of another task: they may
    stand where this says `whole`.
    """

    short: bool = False
    whole: bool = False

    __hash__ = KindOf.__hash__

    @property
    def names(self) -> list[str]:
        """The names of the kinds that may stand here."""
        find = self.family.find
        return [
            name for name in super().names if self.whole or not hasattr(find(name), "outermost")
        ]

    def check(self, value: Any, what: str) -> Any:
        if not self.whole and hasattr(value, "outermost"):
            raise InputError(f"{what}: a {type(value).__name__} is no part of another task")
        return super().check(value, what)

    def read(self, raw: Raw, c: Context) -> Any:
        later: list[Any] = []
        made = super().read(raw, _count_task(c).knowing(later=later))
        if later and c.facts.get("scene") is not None:
            before = c.problems.seen
            try:
                check_deferred_numbers(later, describe_commanded_axes(made, c.facts["scene"]))
            except InputError as error:
                later[0][2].blame(error)
            if c.problems.seen > before:
                raise UnreadableValue
        return made

    def write(self, value: Any, c: Context) -> Raw:
        def commanded() -> Axes:
            return describe_commanded_axes(value, c.facts["scene"])

        return super().write(value, c.knowing(commanded=commanded))


def _count_task(c: Context) -> Context:
    """Return the context within one more task; InputError if there are too many in the text."""
    count, depth = c.facts.get("count", []), c.facts.get("depth", 0)
    count.append(c.path)
    if len(count) > MAX_TASKS + 1:  # which is told already
        raise UnreadableValue
    if len(count) > MAX_TASKS:
        raise InputError(f"more than {MAX_TASKS} tasks, with those within tasks")
    if depth > MAX_NESTING:
        raise InputError(NESTING_MESSAGE)
    return c.knowing(count=count, depth=depth + 1)


def check_nesting(task: Any) -> None:
    """Raise InputError if a task is made of too many, or too many are within each other."""
    level, depth, schemes = [task], 0, 0
    while level:
        depth += 1
        if depth > MAX_NESTING:
            raise InputError(NESTING_MESSAGE)
        inner = [each.inner for each in level if hasattr(each, "inner")]
        schemes += len(level) - len(inner)
        level = [task for several in inner for task in several]
        if schemes + len(level) > MAX_SCHEMES:
            raise InputError(f"made of more than {MAX_SCHEMES} tasks")


def describe_commanded_axes(task: Any, scene: Any) -> Axes:
    """Return units and names of the velocities that a task commands."""
    columns = task.columns(scene)
    units = [scene.velocity_units[i] for i in columns]
    return Axes(units, [scene.velocity_names[i] for i in columns])
