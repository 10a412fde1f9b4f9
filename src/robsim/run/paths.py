"""The paths of an experiment: its numbers by dotted names, true and believed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.declare import Table
from robsim.declare.controls import Control, Place
from robsim.declare.paths import Path, resolved
from robsim.declare.problems import Broken, Problems
from robsim.declare.spec import Context, NoText, Spec
from robsim.declare.tables import controls_of as controls
from robsim.files.changes import value_of
from robsim.run.beliefs import beliefs, common_belief, with_beliefs
from robsim.run.text import SCENE, TaskTable, task_table
from robsim.servo.safety.guard import Guard
from robsim.servo.safety.safety import Safety
from robsim.world.scene import Scene

BELIEF = "belief"
SCENE_SPEC, TASK_SPEC = Table(Scene), Table(object, TaskTable)


class NoNumber(Exception):
    """The signal that a name or a value is none that a path can replace: a file may have it."""


# what a path raises where a file may have the value, or says better why it has not
NOT_BY_PATH = NoNumber, InputError, Broken, LookupError, ArithmeticError, TypeError, ValueError


def path_of(experiment: Any, name: str) -> Path | None:
    """Return the path of a name, within the true or believed scene, or within the experiment.

    It is resolved once for each experiment.
    """
    known: dict[str, Path | None] = vars(experiment).setdefault("_paths", {})
    if name not in known:
        known[name] = _path_of(experiment, name)
    return known[name]


def _path_of(experiment: Any, name: str) -> Path | None:
    top, _, rest = name.partition(".")
    if top == BELIEF:
        return scene_path(believed_by(experiment), rest)
    if top in SCENE:
        return scene_path(experiment.scene, name)
    return _resolved(TASK_SPEC, experiment, name, experiment.scene)


def scene_path(scene: Scene, name: str) -> Path | None:
    """Return the path of a name within a scene; None if it has none of that name."""
    return _resolved(SCENE_SPEC, scene, name, scene)


def _resolved(spec: Spec, value: Any, name: str, scene: Scene) -> Path | None:
    c = Context(Problems(""), facts={"scene": scene, "by_hand": True})
    with suppress(InputError, NoText, Broken):
        return resolved(spec, value, name, c)
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
    path = path_of(experiment, name) if isinstance(name, str) else None
    if path is None or not (is_text(given) or is_number(given)):
        raise NoNumber
    owner = owner_of(experiment, name)
    old = None if path.leaf.shapes else path.get(owner)
    if isinstance(old, str) and given == old:
        return experiment
    if not (path.leaf.shapes or is_number(old)):
        raise NoNumber
    new = path.taken(given, old)
    made = path.replace(owner, new)
    if owner is experiment:
        return made
    if name.startswith(BELIEF):
        shared = common_belief(experiment.task)
        task = with_beliefs(experiment.task, lambda one: made if one is shared else one)
        return experiment.revised(task=task)
    truth = path.get(owner) if any(beliefs(experiment.task)) else None
    task = with_beliefs(experiment.task, lambda one: _followed(experiment, one, name, truth, new))
    return experiment.revised(scene=made, **({} if task is experiment.task else {"task": task}))


def _followed(
    experiment: Any, belief: Scene | None, name: str, truth: Any, new: Any
) -> Scene | None:
    """Return a belief that has the number of the truth if it had the one before."""
    path = None if belief is None else followed(experiment, belief, name, truth)
    return belief if path is None else path.replace(belief, new)


def followed(experiment: Any, belief: Scene, name: str, truth: Any) -> Path | None:
    """Return the path in a belief of a number that is that of the truth; None if it is not."""
    shared = belief is believed_by(experiment)
    path = path_of(experiment, f"{BELIEF}.{name}") if shared else scene_path(belief, name)
    return path if path and np.array_equal(path.get(belief), truth) else None


def is_true(name: str) -> bool:
    """Return whether a dotted name is of the true scene."""
    return name.partition(".")[0] in SCENE


def number_at(experiment: Any, name: str) -> Array:
    """Return the numbers in SI that an experiment has at a dotted name; InputError if none."""
    path = path_of(experiment, name)
    value = None if path is None else path.get(owner_of(experiment, name))
    if not is_number(value):
        raise InputError(f"{name}: the experiment has no number there, but {said(value)}")
    return np.array(value, dtype=float)


def unit_at(experiment: Any, name: str) -> str:
    """Return the unit in Python of the numbers at a dotted name; "" where there is none."""
    path = path_of(experiment, name)
    return "" if path is None else path.leaf.spec.plain_spec.si_unit


def controls_of(of: Any) -> Iterator[Control]:
    """Yield what a person may change of an experiment by hand: all but the scene, and the scenes.

    The believed scene comes before the true one.
    """
    facts = {"scene": of.scene, "by_hand": True}
    place = Place("", Context(Problems(of.source), facts=facts))
    yield from controls(task_table(of), place)
    if beliefs(of.task):
        yield from _controls_of_scene(believed_by(of), place.at(BELIEF))
    yield from _controls_of_scene(of.scene, place)


def _controls_of_scene(scene: Scene, place: Place) -> Iterator[Control]:
    yield from controls(scene, Place(place.path, place.c.knowing(scene=scene)))


def guard_of(made: Any, safety: Safety | None) -> Guard:
    """Return what keeps commands within a safety, in the scene that the task of `made` believes."""
    return Guard(safety or Safety(), believed_by(made))
