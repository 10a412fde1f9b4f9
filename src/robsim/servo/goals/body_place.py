"""Places of objects and cameras at the time when a goal was shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np

from robsim.base.errors import GoalError, InputError, format_value, suggest_names
from robsim.base.value import replace_unchecked
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import (
    MISSING,
    Context,
    DefineSchema,
    JSONSchema,
    PathPart,
    PythonValue,
    Raw,
    Spec,
    UnwritableChange,
    make_expected_error,
)
from robsim.geometry.pose import Pose, check_single_pose
from robsim.geometry.pose_table import POSE, PoseTable
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

Body = Object | MountedCamera
B = TypeVar("B", Object, MountedCamera)


class BodyPlace(NamedTuple):
    """Place of an object or a camera: its name, and its pose in the frame that carries it."""

    name: str
    pose: Pose


Places = tuple[BodyPlace, ...]


def make_places(value: Any) -> Places:
    """Return places from {name: pose} or from pairs; raise GoalError for other values."""
    try:
        poses = dict(value)
    except (TypeError, ValueError):
        raise GoalError(
            f"goal places: expected {{name: pose}}, got {format_value(value)}"
        ) from None
    try:
        return tuple(
            BodyPlace(name, check_single_pose(pose, f"place of {format_value(name)}"))
            for name, pose in poses.items()
        )
    except InputError as error:
        raise GoalError(f"goal places: {error}") from None


@dataclass(frozen=True)
class PlacesSpec(Spec):
    """Declaration of places: a table of poses by the names of the bodies."""

    form: ClassVar[str] = "table"
    phrase: ClassVar[str] = 'poses by name, as in { plate = { position = "40, 0, 5 cm" } }'
    python_phrase: ClassVar[str] = "{name: pose}"

    def check(self, value: object, what: str) -> Places:
        return make_places(value)

    def read(self, raw: Raw, c: Context) -> Places:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        before, poses = c.problems.total_count, _get_old_poses(c)
        for name, table in raw.items():
            if table == PythonValue(None):
                poses.pop(name, None)
            else:
                inner = c.at(name, over=poses.get(name, MISSING))
                poses[name] = inner.read_or_report(POSE, table)
        if c.problems.total_count > before:
            raise UnreadableValue
        return make_places(poses)

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        old = _get_old_poses(c)
        if old.keys() - dict(value).keys():
            raise UnwritableChange
        return {
            name: POSE.write(pose, c.at(name, over=old.get(name, MISSING)))
            for name, pose in value
            if name not in old or pose.matrix.tobytes() != old[name].matrix.tobytes()
        }

    def put(self, table: dict[str, Raw], name: str, value: object, c: Context) -> None:
        if value:
            super().put(table, name, value, c)

    def schema(self, define: DefineSchema) -> JSONSchema:
        return {"type": "object", "additionalProperties": POSE.schema(define)}

    def list_inner_classes(self) -> tuple[type[PoseTable], ...]:
        return (PoseTable,)

    def parts(self, keys: list[str], value: Any, c: Context) -> list[PathPart]:
        if keys[0] not in dict(value):
            return []
        name = keys.pop(0)

        def put(places: Places, pose: Pose) -> Places:
            return make_places({**dict(places), name: pose})

        return [PathPart(POSE, c.at(name), lambda places: dict(places)[name], put, put)]


def _get_old_poses(c: Context) -> dict[str, Pose]:
    """Return the poses of the old places, which a text changes."""
    return dict(c.over) if isinstance(c.over, tuple) else {}


def list_bodies(scene: Scene) -> dict[str, Body]:
    """Return the objects and cameras of a scene by name."""
    return {each.name: each for each in (*scene.objects, *scene.cameras)}


def check_places(places: Iterable[BodyPlace], scene: Scene) -> None:
    """Raise GoalError for the place of a body that the scene does not have."""
    bodies = list_bodies(scene)
    for each in places:
        if each.name not in bodies:
            raise GoalError(
                f"the goal was shown with {format_value(each.name)} at a place, and the scene has no such "
                f"object or camera; "
                f"{suggest_names(each.name, list(bodies), 'objects and cameras')}"
            )


def place_bodies(scene: Scene, poses: Mapping[str, Pose]) -> Scene:
    """Return the scene with some objects and cameras at other poses on their carriers."""

    def place_all(bodies: tuple[B, ...]) -> tuple[B, ...]:
        return tuple(
            replace_unchecked(each, pose=poses[each.name]) if each.name in poses else each
            for each in bodies
        )

    return scene.revised(objects=place_all(scene.objects), cameras=place_all(scene.cameras))


def find_believed_places(
    places: Iterable[BodyPlace], scene: Scene, belief: Scene
) -> dict[str, Pose]:
    """Return the poses of the placed bodies in a believed scene.

    The belief keeps its error: a body at T_true with the believed pose T_true E is believed to have
    been at place E.
    """
    truth, believed = list_bodies(scene), list_bodies(belief)
    return {
        each.name: _displace(each.pose, truth[each.name].pose, believed[each.name].pose)
        for each in places
        if each.name in believed
    }


def _displace(place: Pose, true: Pose, believed: Pose) -> Pose:
    """Return place T_true^-1 T_believed, which is the place itself if both poses are equal."""
    if np.array_equal(true.matrix, believed.matrix):
        return place
    T_place, T_true, T_believed = (Pose(each.matrix) for each in (place, true, believed))
    return T_place @ T_true.inv() @ T_believed
