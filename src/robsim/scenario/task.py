"""From the table [task] to a task."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from robsim.base.errors import InputError
from robsim.describe.task import CONDITIONS, TASKS
from robsim.scenario import follow, option
from robsim.scenario import task_schema as schema
from robsim.scenario.build import configuration
from robsim.scenario.problems import Problems, under
from robsim.servo import Parallel, Priorities, Switch, Task
from robsim.servo.shaping.shaped import Columns
from robsim.world.scene import Scene

Path = tuple[str | int, ...]
MOST_STEPS = 64  # of the path to a task within tasks


@dataclass(frozen=True)
class TaskReader:
    """Reads tasks of a scene, and tasks within tasks; what is wrong goes to the problems.

    `believed` makes a scene of the raw table `belief` of one task, at a path.
    """

    scene: Scene
    belief: Scene | None  # of all tasks that have none of their own
    believed: Callable[..., Scene]
    problems: Problems

    def task(self, table: schema.TaskTable) -> Task:
        """The task; FileError with all that is wrong."""
        made = self._task(table, ("task",))
        self.problems.stop()
        assert made is not None
        with self.problems.at():
            _check_units(table, made, self.scene, ("task",))
        return self.problems.settled(made)

    def _task(self, table: schema.TaskTable, path: Path) -> Task | None:
        """None if something is wrong."""
        with self.problems.at(*path):
            if len(path) > MOST_STEPS:
                raise InputError("tasks within tasks are nested too deeply")
            if isinstance(table, schema.SwitchTable):
                return self._switch(table, path)
            if isinstance(table, schema.PrioritiesTable | schema.TogetherTable):
                return self._several(table, path)
            if isinstance(table, schema.FollowJointsTable):
                return follow.joints(table, self.scene)
            if isinstance(table, schema.FollowPathTable):
                return follow.path(table)
        return self._servo(table, path) if isinstance(table, schema.ServoTable) else None

    def _several(
        self, table: schema.PrioritiesTable | schema.TogetherTable, path: Path
    ) -> Task | None:
        tasks = [self._task(each, (*path, "tasks", i)) for i, each in enumerate(table.tasks)]
        if None in tasks:
            return None
        if isinstance(table, schema.PrioritiesTable):
            return Priorities(tasks, **option.shaped(table))
        return Parallel(tasks)

    def _switch(self, table: schema.SwitchTable, path: Path) -> Task | None:
        first, second = (self._task(getattr(table, k), (*path, k)) for k in ("first", "second"))
        if first is None or second is None:
            return None
        condition = CONDITIONS[table.when.kind](**option.said(table.when, "kind"))
        return Switch(first, second, condition, **option.said(table, *_SWITCH))

    def _servo(self, table: schema.ServoTable, path: Path) -> Task | None:
        belief = self.belief
        if table.belief is not None:
            belief = self.believed(table.belief, *path, "belief")
        before = len(self.problems.found)
        self._check_names(table, path)
        given: Any = None
        with self.problems.at(*path):
            given = option.servo(table, self.scene)
        if given is None or len(self.problems.found) > before:
            return None
        with self.problems.at(*path):
            made: Task = TASKS[table.kind](belief=belief, **given)
            return made
        return None

    def _check_names(self, table: schema.ServoTable, path: Path) -> None:
        """Cameras and targets must exist; without a name there must be only one."""
        features = getattr(table, "features", None)
        parts = features if isinstance(features, list) else [features]
        each: list[tuple[Any, Path]] = [(table, path)]
        for i, part in enumerate(parts):
            inside: Path = (i,) if isinstance(features, list) else ()
            each += [(part, (*path, "features", *inside))] if part is not None else []
        for key, find in (("camera", self.scene.camera), ("target", self.scene.object)):
            for where, at in each:
                said = getattr(where, key)
                if said is None and (where is not table or _all_say(parts, key)):
                    continue
                for name in said if isinstance(said, list) else [said]:
                    with self.problems.at(*at, key):
                        find(name)


_SWITCH = ("kind", "first", "second", "when")


def _all_say(parts: Sequence[Any], key: str) -> bool:
    return all(getattr(part, key, None) is not None for part in parts)


def _check_units(table: schema.TaskTable, task: Any, scene: Scene, path: Path) -> None:
    """Postures and speed limits of joints have the units of what the task commands.

    Which velocities these are is known when the task is there.
    """
    if isinstance(table, schema.TogetherTable):
        for i, (inner, made) in enumerate(zip(table.tasks, task.tasks, strict=True)):
            _check_units(inner, made, scene, (*path, "tasks", i))
        return
    if isinstance(table, schema.FollowJointsTable):
        return  # whose joints are known when it is read
    if isinstance(table, schema.SwitchTable):
        for key in ("first", "second"):
            _check_units(getattr(table, key), getattr(task, key), scene, (*path, key))
        return
    if isinstance(table.secondary, schema.PostureTable):
        with under(*path, "secondary", "q"):
            units, names = _units(scene, task.columns(scene))
            configuration(table.secondary.q, [unit.removesuffix("/s") for unit in units], names)
    if table.limit is not None and isinstance(table.limit.joint, list):
        with under(*path, "limit", "joint"):
            configuration(table.limit.joint, *_units(scene, task.columns(scene)), "speeds")


def _units(scene: Scene, columns: Columns) -> tuple[list[str], list[str]]:
    """Units and names of velocities."""
    each = scene.velocity_units, scene.velocity_names
    units, names = ([told[i] for i in columns] for told in each)
    return units, names
