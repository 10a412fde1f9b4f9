"""Numbers of which each run of an experiment has its own, in the objects that are simulated.

An experiment keeps them by their dotted names, and its scene and task are those of no run. What is
simulated is made of them here, for all runs at once: poses have a leading axis of runs, as a batch
of poses has, and all other numbers a last one, as the stages of a step have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, frozen, numbers
from robsim.base.errors import InputError, said
from robsim.base.values import unchecked
from robsim.geometry.pose import Pose
from robsim.robot.dh_row import dh_constants, rigid
from robsim.robot.joint import Joint
from robsim.robot.robot import Robot
from robsim.servo.tasks.schemes import Partitioned
from robsim.servo.tasks.task import ServoTask
from robsim.world.actuation import Actuation
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

Shapes = tuple[tuple[int | str, ...], ...]  # of one run's number, or of several that will do
POSE: dict[str, Shapes] = {
    "position": ((3,),), "rpy": ((3,),), "rotvec": ((3,),), "rotation": ((3, 3),),
}  # fmt: skip
LENS: dict[str, Shapes] = {
    "K": ((3, 3),), "focal": ((), (2,)), "center": ((2,),), "skew": ((),), "distortion": (("n",),),
}  # fmt: skip
MARKS: dict[str, Shapes] = {"marks": (("N", 3),)}
ROW: dict[str, Shapes] = {"theta": ((),), "d": ((),), "a": ((),), "alpha": ((),)}
IMAGES = "noise", "latency", "quantisation", "outliers", "outlier_size", "dropped"
OTHER: dict[str, dict[str, Shapes]] = {
    "task": {"gain": ((),), "depth_scale": ((), ("N",))},
    "sensing": dict.fromkeys(IMAGES, ((),)),
    "actuation": {"lag": ((),)},
}
SAME_LAW = ServoTask.bound_law, Partitioned.bound_law  # in whatever scene
MAY = (
    "[belief.]cameras.NAME.(K, focal, center, skew, distortion or the pose), "
    "[belief.]objects.NAME.(marks or the pose), [belief.]robots.NAME.(the pose), "
    "[belief.]robots.NAME.links.LINK.(dh.theta, .d, .a, .alpha, place or tail), "
    f"task.gain, task.depth_scale, sensing.({', '.join(IMAGES)}), actuation.lag"
)


class Simulated(NamedTuple):
    """The parts of an experiment with the numbers of all runs."""

    scene: Scene
    task: Any
    sensing: Sensing
    actuation: Actuation


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
    made = {name: frozen(_shaped(name, values)) for name, values in given.items()}
    counts = {name: len(values) for name, values in made.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise InputError(f"vary: every name needs a number for each run, got {listed}")
    _check_imperfections(experiment, made)
    for name, values in made.items():
        for end in _ends(name, values):
            experiment.at({**{n: v[0] for n, v in made.items()}, name: end})
    return made


def has_one_law(task: Any) -> bool:
    """Return whether numbers may differ from run to run of a task: its law asks for no scene."""
    return isinstance(task, ServoTask) and type(task).bound_law in SAME_LAW


def may_differ(experiment: Any, name: str, values: Array) -> bool:
    """Return whether all runs of an experiment can be bound at once with these numbers of a name.

    Else each value needs an experiment of its own.
    """
    if not has_one_law(experiment.task) or _shapes(name.split(".")) is None:
        return False
    if name == "actuation.lag":
        return bool((values > 0.0).all())
    return name != "sensing.latency" or not experiment.sensing.effects


def _check_imperfections(experiment: Any, made: Mapping[str, Array]) -> None:
    """Raise InputError for imperfections that would change what is simulated, not by how much."""
    if (made.get("actuation.lag", np.ones(1)) <= 0.0).any():
        raise InputError("vary: actuation.lag: where lags differ from run to run, each is above 0")
    if "sensing.latency" in made and experiment.sensing.effects:
        raise InputError("vary: sensing.latency: an effect of your own is shown one time for all")


def _ends(name: str, values: Array) -> list[Array]:
    """Return the lowest and the highest of numbers; of rotations, which have none, the first."""
    if name.endswith(".rotation"):
        rigid(values)
        return [values[0]]
    return [values.min(axis=0), values.max(axis=0)]


def _shaped(name: Any, values: Any) -> Array:
    """Return the numbers (runs, ...) of a name; InputError if it cannot differ from run to run."""
    shapes = _shapes(str(name).split("."))
    if shapes is None:
        raise InputError(f"vary: {said(name)} cannot differ from run to run; what may: {MAY}")
    array = numbers(values, str(name), ())
    fits = array.ndim and len(array) and any(_fits(array.shape[1:], shape) for shape in shapes)
    if not fits:
        wanted = " or ".join(str(("runs", *shape)).replace("'", "") for shape in shapes)
        raise InputError(f"vary: {name}: expected shape {wanted}, got {array.shape}")
    return array


def _fits(shape: tuple[int, ...], wanted: Sequence[int | str]) -> bool:
    pairs = zip(shape, wanted, strict=False)
    return len(shape) == len(wanted) and all(isinstance(n, str) or n == m for m, n in pairs)


def _shapes(path: list[str]) -> Shapes | None:
    """Return the shapes that the number of one run may have; None for any other name."""
    path = path[1:] if path[0] == "belief" else path
    found: dict[str, Shapes] = {}
    match path:
        case ["cameras", _, _]:
            found = {**LENS, **POSE}
        case ["objects", _, _]:
            found = {**MARKS, **POSE}
        case ["robots", _, _] | ["robots", _, "links", _, "place" | "tail", _]:
            found = POSE
        case ["robots", _, "links", _, "dh", _]:
            found = ROW
        case ["task" | "sensing" | "actuation" as part, _]:
            found = OTHER[part]
    return found.get(path[-1])


def simulated(experiment: Any) -> Simulated:
    """Return the parts of an experiment with the numbers of all runs that `vary` gave it."""
    return Template(experiment).of(experiment.varied)


class Template:
    """What is the same for all numbers that an experiment may have under the same names."""

    def __init__(self, experiment: Any) -> None:
        varied: dict[str, Array] = experiment.varied
        self.first = experiment.at({name: values[0] for name, values in varied.items()})
        true = {n: x for n, x in varied.items() if n.partition(".")[0] not in (*OTHER, "belief")}
        believes = self.first.task.belief is not None
        self.followed = {n for n in true if believes and _follows(self.first, n, true[n][0])}

    def of(self, varied: Mapping[str, Array]) -> Simulated:
        """Return the parts of the experiment with such numbers."""
        own: dict[str, dict[str, Any]] = {name: {} for name in OTHER}
        true: dict[str, Array] = {}
        believed: dict[str, Array] = {}
        for name, values in varied.items():
            top, _, rest = name.partition(".")
            if top in own:
                own[top][rest] = _last(values)
            elif top == "belief":
                believed[rest] = values
            else:
                true[name] = values
        return self._with(own, true, believed)

    def _with(
        self, own: dict[str, dict[str, Any]], true: dict[str, Array], believed: dict[str, Array]
    ) -> Simulated:
        first = self.first
        belief = first.task.belief
        if belief is not None:
            followed = {name: x for name, x in true.items() if name in self.followed}
            belief = _Numbers({**followed, **believed}).of(belief)
        task = unchecked(first.task, belief=belief, **_task_numbers(own["task"]))
        scene = _Numbers(true).of(first.scene)
        sensing = unchecked(first.sensing, **own["sensing"])
        return Simulated(scene, task, sensing, unchecked(first.actuation, **own["actuation"]))


def _task_numbers(given: dict[str, Array]) -> dict[str, Array]:
    """Return the numbers of a task: gains (runs,), factors of depths (1, runs) or (N, runs)."""
    scale = given.get("depth_scale")
    return given if scale is None else {**given, "depth_scale": np.atleast_2d(scale)}


def _follows(first: Any, name: str, value: Array) -> bool:
    """Return whether what is believed changes with a number of the true scene."""
    for other in _others(name, np.asarray(value)):
        with suppress(InputError):
            return bool(first.at(name, other).task.belief != first.task.belief)
    raise InputError(f"vary: {name}: no other value than {said(value.tolist())} is valid there")


def _others(name: str, value: Array) -> Iterator[Array]:
    """Yield values that differ from one, of which some are valid wherever that one is."""
    if name.endswith(".rotation"):
        yield value @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    elif name.endswith(".K"):
        yield value * np.array([[1.01, 1.0, 1.0], [1.0, 1.01, 1.0], [1.0, 1.0, 1.0]])
    else:
        for change in (1e-3, -1e-3, 1.0, -1.0):
            yield value + change * np.maximum(np.abs(value), 1e-3)


@dataclass(frozen=True)
class _Numbers:
    """Numbers (runs, ...) by name of the scene of an experiment, or of its belief."""

    given: Mapping[str, Array]

    def of(self, scene: Scene) -> Scene:
        """Return a scene with these numbers."""
        for name, values in self.given.items():
            kind, who, *rest = name.split(".")
            parts = list(getattr(scene, kind))
            at = [part.name for part in parts].index(who)
            change = self._robot if kind == "robots" else CHANGED[kind]
            parts[at] = change(parts[at], rest, values)
            scene = unchecked(scene, **{kind: tuple(parts)})
        return scene

    def _robot(self, robot: Robot, path: list[str], values: Array) -> Robot:
        """Return a robot with the numbers of its base or of a link."""
        if path[0] != "links":
            return unchecked(robot, base=_posed(robot.base, path[0], values))
        _, name, group, key = path
        links = list(robot.links)
        at = [link.name for link in links].index(name)
        joint = links[at].joint
        if group == "dh":
            changed = self._dh(f"robots.{robot.name}.links.{name}.dh", joint)
        else:
            changed = unchecked(joint, **{group: _posed(getattr(joint, group), key, values)})
        links[at] = unchecked(links[at], joint=changed)
        return unchecked(robot, links=tuple(links))

    def _dh(self, path: str, joint: Joint) -> Joint:
        """Return a joint with the constants of all numbers of its row."""
        row = joint.dh
        assert row is not None
        numbers = [self.given.get(f"{path}.{key}", getattr(row, key)) for key in ROW]
        rows = np.stack(np.broadcast_arrays(*numbers), axis=-1)
        place, tail = dh_constants(rows, row.convention, joint.model.turns)
        return unchecked(joint, place=place, tail=tail)


def _camera(eye: MountedCamera, path: list[str], values: Array) -> MountedCamera:
    (key,) = path
    if key in POSE:
        return unchecked(eye, pose=_posed(eye.pose, key, values))
    if key == "distortion":
        return unchecked(eye, camera=unchecked(eye.camera, distortion=_last(values)))
    K = np.array(eye.camera.K)
    K = np.repeat(K[..., None], len(values), axis=2) if K.ndim == 2 else K
    if key == "K":
        K = np.array(_last(values))
    elif key == "focal":
        K[0, 0], K[1, 1] = np.broadcast_to(_last(values), (2, len(values)))
    elif key == "center":
        K[0, 2], K[1, 2] = _last(values)
    else:
        K[0, 1] = values
    return unchecked(eye, camera=unchecked(eye.camera, K=frozen(K)))


def _object(thing: Object, path: list[str], values: Array) -> Object:
    (key,) = path
    if key in POSE:
        return unchecked(thing, pose=_posed(thing.pose, key, values))
    return unchecked(thing, marks=_last(values))


CHANGED: dict[str, Callable[[Any, list[str], Array], Any]] = {
    "cameras": _camera,
    "objects": _object,
}


def _posed(pose: Pose, key: str, values: Array) -> Pose:
    """Return poses (runs,) with other positions (runs, 3) or rotations."""
    T = np.array(np.broadcast_to(pose.matrix, (len(values), 4, 4)))
    if key == "position":
        T[:, :3, 3] = values
    elif key == "rotation":
        T[:, :3, :3] = values
    else:
        turned = Pose.at(rpy=values) if key == "rpy" else Pose.at(rotvec=values)
        T[:, :3, :3] = turned.rotation
    return Pose(T)


def _last(values: Array) -> Array:
    """Return numbers with the axis of runs last, read-only."""
    return frozen(np.ascontiguousarray(np.moveaxis(values, 0, -1)))
