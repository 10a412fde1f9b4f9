"""The numbers of an experiment by dotted names, true and believed."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import Table
from robsim.declare.context import Context, NoTextError
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.dotted_paths import DottedPath, resolve_path
from robsim.declare.problems import Problems, UnreadableValue
from robsim.declare.spec import Spec
from robsim.declare.tables import yield_controls
from robsim.files.overrides import parse_toml_value
from robsim.run.beliefs import find_common_belief, list_beliefs, replace_beliefs
from robsim.run.experiment_text import SCENE, SCENE_SPEC, TaskTable, make_task_table
from robsim.servo.safety.guard import SafetyGuard
from robsim.servo.safety.safety import Safety
from robsim.world.scene import Scene

BELIEF = "belief"
_BELIEVED_DYNAMICS = re.compile(
    r"belief\.robots\..+\.links\.[^.]+\.(armature|damping|friction|effort|inertia(\..*)?)"
)
TASK_SPEC = Table(object, TaskTable)


class NoNumberError(Exception):
    """The signal that a path cannot replace this value; the reader of texts may still accept it."""


# errors after which the reader of texts tries the change and raises a better error if it fails
NOT_BY_PATH = (NoNumberError, UnreadableValue, LookupError, ArithmeticError, TypeError, ValueError)


def find_path(experiment: Any, name: str) -> DottedPath | None:
    """Return the path of a name within the true scene, the believed scene or the experiment.

    Paths are cached in the experiment.
    """
    known: dict[str, DottedPath | None] = vars(experiment).setdefault("_paths", {})
    if name not in known:
        known[name] = _resolve_experiment_path(experiment, name)
    return known[name]


def _resolve_experiment_path(experiment: Any, name: str) -> DottedPath | None:
    owner = find_path_owner(experiment, name)
    if owner is experiment:
        return _resolve_number_path(TASK_SPEC, experiment, name, experiment.scene)
    return find_scene_path(owner, name.removeprefix(f"{BELIEF}."))


def find_scene_path(scene: Scene, name: str) -> DottedPath | None:
    """Return the path of a name within a scene; None if the scene lacks the name."""
    return _resolve_number_path(SCENE_SPEC, scene, name, scene)


def _resolve_number_path(spec: Spec, value: Any, name: str, scene: Scene) -> DottedPath | None:
    c = Context(Problems(""), facts={"scene": scene, "by_hand": True})
    with suppress(InputError, NoTextError, UnreadableValue):
        return resolve_path(spec, value, name, c)
    return None


def get_believed_scene(experiment: Any) -> Scene:
    """Return the common belief of the tasks of an experiment; the true scene if there is none."""
    return find_common_belief(experiment.task) or experiment.scene


def check_belief_name(name: object) -> None:
    """Raise InputError for a number of the dynamics of the believed scene, which has no effect."""
    if isinstance(name, str) and _BELIEVED_DYNAMICS.fullmatch(name):
        raise InputError(
            f"{name}: a task believes no masses and no friction; the model of a drive does "
            "(actuation.drive.model)"
        )


def find_path_owner(experiment: Any, name: str) -> Any:
    """Return the object with the attribute that a dotted name sets: a scene, or the experiment."""
    top = name.partition(".")[0]
    if top == BELIEF:
        return get_believed_scene(experiment)
    return experiment.scene if top in SCENE else experiment


def is_numeric_value(value: Any) -> bool:
    """Return whether a value is a number, a nonempty array, or nested lists of numbers."""
    if isinstance(value, tuple | list):
        return bool(value) and all(map(is_numeric_value, value))
    if isinstance(value, np.ndarray):
        return bool(value.size)
    return isinstance(value, int | float | np.number) and not isinstance(value, bool | np.bool_)


def is_text_value(value: Any) -> bool:
    """Return whether a value is a text, or nested lists of texts."""
    return isinstance(value, str) or (isinstance(value, list) and all(map(is_text_value, value)))


def replace_numbers(experiment: Any, changes: Mapping[str, Any]) -> Any:
    """Return an experiment with other numbers, all checked; names of the true scene come first.

    Raise NoNumberError if a name or a value is not a number, InputError if a number is not valid.
    """
    for name, value in sorted(changes.items(), key=lambda each: each[0].startswith(BELIEF)):
        experiment = _replace_one_number(experiment, name, parse_toml_value(value))
    return experiment


def _replace_one_number(experiment: Any, name: str, value: Any) -> Any:
    path = find_path(experiment, name) if isinstance(name, str) else None
    if path is None or not (is_text_value(value) or is_numeric_value(value)):
        raise NoNumberError
    owner = find_path_owner(experiment, name)
    old = None if path.leaf.shapes else path.get(owner)
    if isinstance(old, str) and value == old:
        return experiment
    if not (path.leaf.shapes or is_numeric_value(old)):
        raise NoNumberError
    new = path.convert_leaf_value(value, old)
    owner_copy = path.replace(owner, new)
    if owner is experiment:
        return owner_copy
    if name.startswith(BELIEF):
        shared = find_common_belief(experiment.task)
        task = replace_beliefs(experiment.task, lambda one: owner_copy if one is shared else one)
        return experiment.revised(task=task)
    truth = path.get(owner) if any(list_beliefs(experiment.task)) else None
    task = replace_beliefs(
        experiment.task, lambda one: _update_belief(experiment, one, name, truth, new)
    )
    return experiment.revised(
        scene=owner_copy, **({} if task is experiment.task else {"task": task})
    )


def _update_belief(
    experiment: Any, belief: Scene | None, name: str, truth: Any, new: Any
) -> Scene | None:
    """Return a belief that takes a new true value, if it had the old true value."""
    path = None if belief is None else find_followed_path(experiment, belief, name, truth)
    return belief if path is None else path.replace(belief, new)


def find_followed_path(experiment: Any, belief: Scene, name: str, truth: Any) -> DottedPath | None:
    """Return the path of a name in a belief if its value is the true one; else None."""
    shared = belief is get_believed_scene(experiment)
    path = find_path(experiment, f"{BELIEF}.{name}") if shared else find_scene_path(belief, name)
    return path if path and np.array_equal(path.get(belief), truth) else None


def is_true_scene_name(name: str) -> bool:
    """Return whether a dotted name belongs to the true scene."""
    return name.partition(".")[0] in SCENE


def get_number_at(experiment: Any, name: str) -> Array:
    """Return the numbers of an experiment at a dotted name, in SI; InputError if there are none."""
    path = find_path(experiment, name)
    value = None if path is None else path.get(find_path_owner(experiment, name))
    if not is_numeric_value(value):
        raise InputError(f"{name}: expected a number in the experiment, got {format_value(value)}")
    return np.array(value, dtype=float)


def get_unit_at(experiment: Any, name: str) -> str:
    """Return the SI unit of the numbers at a dotted name; "" if there is none."""
    path = find_path(experiment, name)
    return "" if path is None else path.leaf.spec.plain_spec.si_unit


def yield_experiment_controls(of: Any) -> Iterator[Control]:
    """Yield the editable values of an experiment: the task and settings, then the scenes.

    The believed scene comes before the true scene. If the beliefs of tasks differ, the tasks alone
    have them. The dynamics of the true scene have controls if a drive acts; drives have a model of
    their own.
    """
    apart = find_common_belief(of.task) is None
    driven = getattr(of.actuation, "drive", None) is not None
    facts = {"scene": of.scene, "by_hand": True, "apart": apart, "driven": driven}
    place = ControlPlace("", Context(Problems(of.source), facts=facts))
    yield from yield_controls(make_task_table(of), place)
    beliefs = list_beliefs(of.task)
    if beliefs and not (apart and any(each is not None for each in beliefs)):
        believed = get_believed_scene(of)
        unaware = place.c.with_facts(driven=False, scene=believed)
        yield from SCENE_SPEC.controls(believed, place.at(BELIEF, c=unaware))
    yield from SCENE_SPEC.controls(of.scene, place)


def make_command_guard(experiment: Any, safety: Safety | None) -> SafetyGuard:
    """Return the guard that limits commands to a safety, in the scene that the task believes in.

    The command of a period acts until the first call of the next period. The call before that may
    be up to one period later than the call with the command.
    """
    used = safety or Safety()
    hold = experiment.dt + (used.call_interval or 0.0)
    return SafetyGuard(used, get_believed_scene(experiment), hold)
