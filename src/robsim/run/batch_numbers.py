"""Numbers of which each run of an experiment has its own, in the objects that are simulated.

An experiment keeps them by their dotted names, and its scene and task are those of no run. What is
simulated is made of them here, for all runs at once: each path puts the numbers of all runs in its
place, as the declaration there says that stages take them.
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

SAME_LAW = ServoTask.bound_law, Partitioned.bound_law  # in whatever scene
MAY = (
    "a number of a task, of imperfections, or of a scene, true or believed, whose declaration says "
    "that stages take one for each run, such as task.gain, sensing.noise, cameras.NAME.focal, "
    "objects.NAME.position or belief.robots.NAME.links.LINK.dh.a"
)


def check_batch_numbers(experiment: Any, given: Mapping[str, Any]) -> dict[str, Array]:
    """Return numbers by name, each (runs, ...); InputError or FileError if some cannot be so.

    The lowest and the highest of each must be valid, and so are those between.
    """
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"vary: expected {{name: numbers}}, got {format_value(given)}")
    if not has_one_law(experiment.task):
        wanted = "one servo task, whose law does not depend on the scene"
        kind = type(experiment.task).__name__
        raise InputError(f"vary: numbers may differ from run to run of {wanted}, not {kind}")
    made = {
        name: make_read_only(_check_batch_shape(experiment, name, x)) for name, x in given.items()
    }
    counts = {name: len(values) for name, values in made.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise InputError(f"vary: every name needs a number for each run, got {listed}")
    first = {name: values[0] for name, values in made.items()}
    for name, values in made.items():
        for end in _find_extreme_values(name, values):
            experiment.at({**first, name: end})
    return made


def has_one_law(task: Any) -> bool:
    """Return whether numbers may differ from run to run of a task: its law asks for no scene."""
    return isinstance(task, ServoTask) and type(task).bound_law in SAME_LAW


def is_batchable(experiment: Any, name: str, values: Array) -> bool:
    """Return whether all runs of an experiment can be bound at once with these numbers of a name.

    Else each value needs an experiment of its own.
    """
    if not has_one_law(experiment.task):
        return False
    path = find_path(experiment, name)
    return path is not None and path.leaf.stack is not None and _is_above_bound(path, values)


def _is_above_bound(path: DottedPath, values: Array) -> bool:
    """Return whether numbers change by how much, and not what is simulated."""
    return path.leaf.above is None or bool((values > path.leaf.above).all())


def _find_extreme_values(name: str, values: Array) -> list[Array]:
    """Return the lowest and the highest of numbers; of rotations, which have none, the first."""
    if name.endswith(".rotation"):
        pose_from_rotation(values)
        return [values[0]]
    return [values.min(axis=0), values.max(axis=0)]


def _check_batch_shape(experiment: Any, name: Any, values: Any) -> Array:
    """Return the numbers (runs, ...) of a name; InputError if it cannot differ from run to run."""
    path = find_path(experiment, str(name))
    if path is None or path.leaf.stack is None:
        why = f"; what may: {MAY}" if path else f": {_make_refusal(experiment, str(name), values)}"
        raise InputError(f"vary: {format_value(name)} cannot differ from run to run{why}")
    array, shapes = as_floats(values, str(name), ()), path.leaf.shapes
    if not (array.ndim and len(array) and path.leaf.fits(array.shape[1:])):
        wanted = " or ".join(str(("runs", *shape)).replace("'", "") for shape in shapes)
        raise InputError(f"vary: {name}: expected shape {wanted}, got {array.shape}")
    if not _is_above_bound(path, array):
        above = f"each is above {path.leaf.above:g}"
        raise InputError(f"vary: {name}: where they differ from run to run, {above}")
    return array


def _make_refusal(experiment: Any, name: str, values: Any) -> str:
    """Return what a file says of a name that has no path."""
    try:
        experiment.at(name, np.asarray(values).tolist()[0])
    except (InputError, TypeError, IndexError, ValueError) as error:
        return str(error)
    return "it is no number"


class BatchTemplate:
    """What is the same for all numbers that an experiment may have under the same names."""

    def __init__(self, experiment: Any) -> None:
        varied: dict[str, Array] = experiment.varied
        self.first = experiment.at({name: values[0] for name, values in varied.items()})
        self.paths: dict[str, DottedPath] = {name: find_path(self.first, name) for name in varied}  # type: ignore[misc]
        belief, scene = experiment.task.belief, experiment.scene
        self.followed: dict[str, DottedPath] = {}  # the paths in the belief, of what is true
        for name in filter(
            is_true_scene_name, varied if self.first.task.belief is not None else ()
        ):
            truth = self.paths[name].get(scene)
            if belief is None or find_followed_path(experiment, belief, name, truth):
                self.followed[name] = find_scene_path(self.first.task.belief, name)  # type: ignore[assignment]

    def of(self, varied: Mapping[str, Array]) -> Any:
        """Return an experiment of such numbers; what is true comes first."""
        made = self.first
        for name, values in sorted(
            varied.items(), key=lambda each: not is_true_scene_name(each[0])
        ):
            path = self.paths[name]
            if name.startswith(BELIEF):
                made = _replace_belief(made, path.stack(get_believed_scene(made), values))
            elif not is_true_scene_name(name):
                made = path.stack(made, values)
            else:
                if name in self.followed:
                    belief = self.followed[name].stack(made.task.belief, values)
                    made = _replace_belief(made, belief)
                made = replace_unchecked(made, scene=path.stack(made.scene, values))
        return made


def _replace_belief(made: Any, belief: Scene) -> Any:
    return replace_unchecked(made, task=replace_beliefs(made.task, lambda _: belief))
