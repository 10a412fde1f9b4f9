"""Numbers of which each run of an experiment has its own, in the objects that are simulated.

An experiment keeps them by their dotted names, and its scene and task are those of no run. What is
simulated is made of them here, for all runs at once: each path puts the numbers of all runs in its
place, as the declaration there says that stages take them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen, numbers
from robsim.base.errors import InputError, said
from robsim.base.values import unchecked
from robsim.declare.paths import Path
from robsim.robot.dh_row import rigid
from robsim.run.beliefs import with_beliefs
from robsim.run.paths import BELIEF, believed_by, followed, is_true, path_of, scene_path
from robsim.servo.tasks.schemes import Partitioned
from robsim.servo.tasks.task import ServoTask
from robsim.world.scene import Scene

SAME_LAW = ServoTask.bound_law, Partitioned.bound_law  # in whatever scene
MAY = (
    "a number of a task, of imperfections, or of a scene, true or believed, whose declaration says "
    "that stages take one for each run, such as task.gain, sensing.noise, cameras.NAME.focal, "
    "objects.NAME.position or belief.robots.NAME.links.LINK.dh.a"
)


def checked(experiment: Any, given: Mapping[str, Any]) -> dict[str, Array]:
    """Return numbers by name, each (runs, ...); InputError or FileError if some cannot be so.

    The lowest and the highest of each must be valid, and so are those between.
    """
    if not isinstance(given, Mapping) or not given:
        raise InputError(f"vary: expected {{name: numbers}}, got {said(given)}")
    if not has_one_law(experiment.task):
        wanted = "one servo task, whose law does not depend on the scene"
        kind = type(experiment.task).__name__
        raise InputError(f"vary: numbers may differ from run to run of {wanted}, not {kind}")
    made = {name: frozen(_shaped(experiment, name, x)) for name, x in given.items()}
    counts = {name: len(values) for name, values in made.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise InputError(f"vary: every name needs a number for each run, got {listed}")
    first = {name: values[0] for name, values in made.items()}
    for name, values in made.items():
        for end in _ends(name, values):
            experiment.at({**first, name: end})
    return made


def has_one_law(task: Any) -> bool:
    """Return whether numbers may differ from run to run of a task: its law asks for no scene."""
    return isinstance(task, ServoTask) and type(task).bound_law in SAME_LAW


def may_differ(experiment: Any, name: str, values: Array) -> bool:
    """Return whether all runs of an experiment can be bound at once with these numbers of a name.

    Else each value needs an experiment of its own.
    """
    if not has_one_law(experiment.task):
        return False
    path = path_of(experiment, name)
    return path is not None and path.leaf.stack is not None and _is_above(path, values)


def _is_above(path: Path, values: Array) -> bool:
    """Return whether numbers change by how much, and not what is simulated."""
    return path.leaf.above is None or bool((values > path.leaf.above).all())


def _ends(name: str, values: Array) -> list[Array]:
    """Return the lowest and the highest of numbers; of rotations, which have none, the first."""
    if name.endswith(".rotation"):
        rigid(values)
        return [values[0]]
    return [values.min(axis=0), values.max(axis=0)]


def _shaped(experiment: Any, name: Any, values: Any) -> Array:
    """Return the numbers (runs, ...) of a name; InputError if it cannot differ from run to run."""
    path = path_of(experiment, str(name))
    if path is None or path.leaf.stack is None:
        why = f"; what may: {MAY}" if path else f": {_refusal(experiment, str(name), values)}"
        raise InputError(f"vary: {said(name)} cannot differ from run to run{why}")
    array, shapes = numbers(values, str(name), ()), path.leaf.shapes
    if not (array.ndim and len(array) and path.leaf.fits(array.shape[1:])):
        wanted = " or ".join(str(("runs", *shape)).replace("'", "") for shape in shapes)
        raise InputError(f"vary: {name}: expected shape {wanted}, got {array.shape}")
    if not _is_above(path, array):
        above = f"each is above {path.leaf.above:g}"
        raise InputError(f"vary: {name}: where they differ from run to run, {above}")
    return array


def _refusal(experiment: Any, name: str, values: Any) -> str:
    """Return what a file says of a name that has no path."""
    try:
        experiment.at(name, np.asarray(values).tolist()[0])
    except (InputError, TypeError, IndexError, ValueError) as error:
        return str(error)
    return "it is no number"


class Template:
    """What is the same for all numbers that an experiment may have under the same names."""

    def __init__(self, experiment: Any) -> None:
        varied: dict[str, Array] = experiment.varied
        self.first = experiment.at({name: values[0] for name, values in varied.items()})
        self.paths: dict[str, Path] = {name: path_of(self.first, name) for name in varied}  # type: ignore[misc]
        belief, scene = experiment.task.belief, experiment.scene
        self.followed: dict[str, Path] = {}  # the paths in the belief, of what is true
        for name in filter(is_true, varied if self.first.task.belief is not None else ()):
            truth = self.paths[name].get(scene)
            if belief is None or followed(experiment, belief, name, truth):
                self.followed[name] = scene_path(self.first.task.belief, name)  # type: ignore[assignment]

    def of(self, varied: Mapping[str, Array]) -> Any:
        """Return an experiment of such numbers; what is true comes first."""
        made = self.first
        for name, values in sorted(varied.items(), key=lambda each: not is_true(each[0])):
            path = self.paths[name]
            if name.startswith(BELIEF):
                made = _believing(made, path.stack(believed_by(made), values))
            elif not is_true(name):
                made = path.stack(made, values)
            else:
                if name in self.followed:
                    belief = self.followed[name].stack(made.task.belief, values)
                    made = _believing(made, belief)
                made = unchecked(made, scene=path.stack(made.scene, values))
        return made


def _believing(made: Any, belief: Scene) -> Any:
    return unchecked(made, task=with_beliefs(made.task, lambda _: belief))
