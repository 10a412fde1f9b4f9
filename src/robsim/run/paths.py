"""The paths of an experiment: its numbers by dotted names, true and believed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from typing import Any

import numpy as np

from robsim.base.errors import InputError
from robsim.base.values import unchecked
from robsim.declare import Table
from robsim.declare.paths import Path, resolved
from robsim.declare.problems import Broken, Problems
from robsim.declare.spec import Context, NoText
from robsim.files.changes import value_of
from robsim.run.text import SCENE, TaskTable, beliefs, common_belief
from robsim.world.scene import Scene

BELIEF = "belief"
SCENE_SPEC, TASK_SPEC = Table(Scene), Table(object, TaskTable)


class NoNumber(Exception):
    """The signal that a name or a value is none that a path can replace: a file may have it."""


def path_of(experiment: Any, name: str) -> Path | None:
    """Return the path of a name, within the true or believed scene, or within the experiment."""
    top, _, rest = name.partition(".")
    scene = believed_by(experiment) if top == BELIEF else experiment.scene
    c = Context(Problems(""), facts={"scene": scene, "by_hand": True})
    with suppress(InputError, NoText, Broken):
        if top == BELIEF:
            return resolved(SCENE_SPEC, scene, rest, c)
        if top in SCENE:
            return resolved(SCENE_SPEC, scene, name, c)
        return resolved(TASK_SPEC, experiment, name, c)
    return None


def believed_by(experiment: Any) -> Scene:
    """Return the scene that the tasks of an experiment believe in, if it is one; else the true."""
    return common_belief(experiment.task) or experiment.scene


def owner_of(experiment: Any, name: str) -> Any:
    """Return within what the path of a name leads."""
    top = name.partition(".")[0]
    if top == BELIEF:
        return believed_by(experiment)
    return experiment.scene if top in SCENE else experiment


def is_number(value: Any) -> bool:
    """Return whether a value is a number, or an array or a list of them, also within lists."""
    if isinstance(value, tuple | list):
        return bool(value) and all(map(is_number, value))
    if isinstance(value, np.ndarray):
        return bool(value.size)
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_)


def is_text(value: Any) -> bool:
    """Return whether a value is a text, or a list of them."""
    return isinstance(value, str) or (isinstance(value, list) and all(map(is_text, value)))


def with_numbers(experiment: Any, changes: Mapping[str, Any]) -> Any:
    """Return an experiment with other numbers, every check made; what is true comes first.

    NoNumber: a name or a value is none of a number. InputError: a number is not valid there.
    """
    for name, given in sorted(changes.items(), key=lambda each: each[0].startswith(BELIEF)):
        experiment = _with_number(experiment, name, value_of(given))
    return experiment


def _with_number(experiment: Any, name: str, given: Any) -> Any:
    path = path_of(experiment, name)
    if path is None:
        raise NoNumber
    owner = owner_of(experiment, name)
    old = path.get(owner)
    if isinstance(old, str) and given == old:
        return experiment
    if not is_number(old) or not (is_text(given) or is_number(given)):
        raise NoNumber
    new = path.taken(given, old)
    made = path.replace(owner, new)
    if owner is experiment:
        return made
    if name.startswith(BELIEF):
        shared = common_belief(experiment.task)
        task = with_beliefs(experiment.task, lambda one: made if one is shared else one)
        return experiment.revised(task=task)
    task = with_beliefs(experiment.task, lambda one: _followed(one, path, old, new))
    return experiment.revised(scene=made, **({} if task is experiment.task else {"task": task}))


def _followed(belief: Scene | None, path: Path, old: Any, new: Any) -> Scene | None:
    """Return a belief that has the number of the truth if it had the one before."""
    if belief is None:
        return None
    same = False
    with suppress(InputError, AttributeError, TypeError):
        same = np.array_equal(path.get(belief), old)
    followed: Scene = path.replace(belief, new) if same else belief
    return followed


def with_beliefs(task: Any, change: Callable[[Scene | None], Scene | None]) -> Any:
    """Return a task, all tasks within which have another belief."""
    return task if all(change(one) is one for one in beliefs(task)) else _within(task, change)


def _within(task: Any, change: Callable[[Scene | None], Scene | None]) -> Any:
    """Return a task, or a part of one, with all that is within it."""
    if isinstance(task, tuple):
        return tuple(_within(each, change) for each in task)
    if hasattr(task, "belief"):
        new = change(task.belief)
        return task if new is task.belief else unchecked(task, belief=new)
    if not any(hasattr(task, name) for name in ("inner", "task")):
        return task
    own = {each.name: getattr(task, each.name) for each in fields(task)}
    return unchecked(task, **{name: _within(value, change) for name, value in own.items()})
