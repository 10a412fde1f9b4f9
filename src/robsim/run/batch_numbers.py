"""Numbers that differ from run to run, in the objects that are simulated.

An experiment stores these numbers by their dotted names. `BatchTemplate` builds the simulated scene
and task of all runs at once: it replaces each number by an array with the numbers of all runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.value import replace_unchecked
from robsim.declare.dotted_paths import DottedPath
from robsim.robot.dh_row import pose_from_rotation
from robsim.run.beliefs import replace_beliefs
from robsim.run.experiment_paths import (
    BELIEF,
    find_followed_path,
    find_path,
    find_scene_path,
    get_believed_scene,
    is_true_scene_name,
)
from robsim.servo.tasks.schemes import Partitioned
from robsim.servo.tasks.task import ServoTask
from robsim.world.scene import Scene

SAME_LAW = ServoTask.bound_law, Partitioned.bound_law  # laws that do not depend on the scene
MAY = (
    "most numbers of tasks, of imperfections, and of scenes, true or believed, such as task.gain, "
    "sensing.noise, cameras.NAME.focal, objects.NAME.position or "
    "belief.robots.NAME.links.LINK.dh.a"
)


def check_batch_numbers(experiment: Any, requested: Mapping[str, Any]) -> dict[str, Array]:
    """Return numbers (runs, ...) by name; InputError or FileError if some are not valid.

    Only the lowest and the highest value of each name are checked.
    """
    if not isinstance(requested, Mapping) or not requested:
        raise InputError(f"vary: expected {{name: numbers}}, got {format_value(requested)}")
    if not has_one_law(experiment.task):
        requirement = "one servo task with a law that does not depend on the scene"
        kind = type(experiment.task).__name__
        raise InputError(f"vary: numbers may differ from run to run for {requirement}, not {kind}")
    arrays = {
        name: make_read_only(_check_batch_shape(experiment, name, x))
        for name, x in requested.items()
    }
    counts = {name: len(values) for name, values in arrays.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise InputError(f"vary: every name needs a number for each run, got {listed}")
    first = {name: values[0] for name, values in arrays.items()}
    for name, values in arrays.items():
        for end in _find_extreme_values(name, values):
            experiment.at({**first, name: end})
    return arrays


def has_one_law(task: Any) -> bool:
    """Return whether numbers may differ from run to run: the law does not depend on the scene."""
    return isinstance(task, ServoTask) and type(task).bound_law in SAME_LAW


def is_batchable(experiment: Any, name: str, values: Array) -> bool:
    """Return whether all runs can be bound at once with these numbers of a name.

    If not, each value needs its own experiment.
    """
    if not has_one_law(experiment.task):
        return False
    path = find_path(experiment, name)
    return path is not None and path.leaf.stack is not None and _is_above_bound(path, values)


def _is_above_bound(path: DottedPath, values: Array) -> bool:
    """Return whether all numbers exceed the bound below which they change the structure."""
    return path.leaf.above is None or bool((values > path.leaf.above).all())


def _find_extreme_values(name: str, values: Array) -> list[Array]:
    """Return the lowest and the highest number. Rotations have no order: return the first."""
    if name.endswith(".rotation"):
        pose_from_rotation(values)
        return [values[0]]
    return [values.min(axis=0), values.max(axis=0)]


def _check_batch_shape(experiment: Any, name: Any, values: Any) -> Array:
    """Return the numbers (runs, ...) of a name; InputError if it cannot differ from run to run."""
    path = find_path(experiment, str(name))
    if path is None or path.leaf.stack is None:
        why = f"; these can: {MAY}" if path else f": {_make_refusal(experiment, str(name), values)}"
        raise InputError(f"vary: {format_value(name)} cannot differ from run to run{why}")
    array, shapes = as_floats(values, str(name), ()), path.leaf.shapes
    if not (array.ndim and len(array) and path.leaf.fits(array.shape[1:])):
        expected = " or ".join(str(("runs", *shape)).replace("'", "") for shape in shapes)
        raise InputError(f"vary: {name}: expected shape {expected}, got {array.shape}")
    if not _is_above_bound(path, array):
        above = f"each must be above {path.leaf.above:g}"
        raise InputError(f"vary: {name}: if the numbers differ from run to run, {above}")
    return array


def _make_refusal(experiment: Any, name: str, values: Any) -> str:
    """Return the message of the scenario reader for a name that has no path."""
    try:
        experiment.at(name, np.asarray(values).tolist()[0])
    except (InputError, TypeError, IndexError, ValueError) as error:
        return str(error)
    return "it is not a number"


class BatchTemplate:
    """The common part of all experiments that differ only in the varied numbers."""

    def __init__(self, experiment: Any) -> None:
        varied: dict[str, Array] = experiment.varied
        self.first = experiment.at({name: values[0] for name, values in varied.items()})
        self.paths: dict[str, DottedPath] = {name: find_path(self.first, name) for name in varied}  # type: ignore[misc]
        belief, scene = getattr(experiment.task, "belief", None), experiment.scene
        self.followed: dict[str, DottedPath] = {}  # paths in the belief for names of the true scene
        first = getattr(self.first.task, "belief", None)
        believed = varied if first is not None else ()
        for name in filter(is_true_scene_name, believed):
            truth = self.paths[name].get(scene)
            if belief is None or find_followed_path(experiment, belief, name, truth):
                self.followed[name] = find_scene_path(first, name)  # type: ignore[assignment,arg-type]

    def of(self, varied: Mapping[str, Array]) -> Any:
        """Return the experiment with these numbers; names of the true scene are set first."""
        experiment = self.first
        for name in sorted(varied, key=is_true_scene_name, reverse=True):
            path, values = self.paths[name], varied[name]
            if name.startswith(BELIEF):
                belief = path.stack(get_believed_scene(experiment), values)
                experiment = _replace_belief(experiment, belief)
            elif not is_true_scene_name(name):
                experiment = path.stack(experiment, values)
            else:
                if name in self.followed:
                    belief = self.followed[name].stack(experiment.task.belief, values)
                    experiment = _replace_belief(experiment, belief)
                scene = path.stack(experiment.scene, values)
                experiment = replace_unchecked(experiment, scene=scene)
        return experiment


def _replace_belief(experiment: Any, belief: Scene) -> Any:
    return replace_unchecked(experiment, task=replace_beliefs(experiment.task, lambda _: belief))
