"""Places of objects and cameras at the time when a goal was shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np

from robsim.base.errors import GoalError, InputError, format_value, suggest_names
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue, Name, described
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

Body = Object | MountedCamera
B = TypeVar("B", Object, MountedCamera)


@described
@dataclass(frozen=True)
class BodyPlace(DeclaredValue):
    """Place of an object or a camera when a goal was shown: its pose on its carrier.

    Examples
    --------
    >>> BodyPlace("plate", Pose.at(0.4, 0, 0.05)).pose.position
    array([0.4 , 0.  , 0.05])
    """

    name: Annotated[str, Name(), "Name of the object or camera."]
    pose: Annotated[Pose, FLAT_POSE, "Pose of the body in the frame that carries it."] = IDENTITY


Places = tuple[BodyPlace, ...]


def make_places(value: Any) -> Places:
    """Return places from {name: pose} or from a list of places; GoalError for other values."""
    try:
        if isinstance(value, Mapping):
            return tuple(BodyPlace(name, pose) for name, pose in value.items())
        places = tuple(value)
    except InputError as error:
        raise GoalError(f"goal places: {error}") from None
    except TypeError:
        places = (value,)
    names = [getattr(each, "name", None) for each in places]
    if not all(isinstance(each, BodyPlace) for each in places) or len(set(names)) < len(names):
        text = f"expected {{name: pose}}, one pose for each body, got {format_value(value)}"
        raise GoalError(f"goal places: {text}")
    return places


def list_bodies(scene: Scene) -> dict[str, Body]:
    """Return the objects and cameras of a scene by name."""
    bodies: tuple[Body, ...] = (*scene.objects, *scene.cameras)
    return {each.name: each for each in bodies}


def check_places(places: Iterable[BodyPlace], scene: Scene) -> None:
    """Raise GoalError for the place of a body that the scene does not have."""
    bodies = list_bodies(scene)
    for each in places:
        if each.name not in bodies:
            raise GoalError(
                f"the goal was shown with {format_value(each.name)} at a place, and the scene has "
                "no such object or camera; "
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
