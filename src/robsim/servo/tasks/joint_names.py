"""Joints by name: those with one coordinate and one velocity of their own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from robsim.base.errors import InputError, suggest_names
from robsim.world.scene import Scene


class JointIndices(NamedTuple):
    """The indices of a joint among the velocities and the coordinates of a scene."""

    velocity: int
    coordinate: int


def index_joints(scene: Scene) -> dict[str, JointIndices]:
    """Return every joint of one coordinate and velocity by its full name, such as "panda.link3"."""
    found: dict[str, JointIndices] = {}
    velocity = coordinate = 0
    for robot in scene.robots:
        rows = {name: i for i, name in enumerate(robot.coordinate_names)}
        for i, name in enumerate(robot.velocity_names):
            if name in rows:
                found[f"{robot.name}.{name}"] = JointIndices(velocity + i, coordinate + rows[name])
        velocity, coordinate = velocity + robot.nv, coordinate + robot.nq
    return found


def find_joints(scene: Scene, names: Iterable[str], what: str) -> list[JointIndices]:
    """Return the joints of some names, in which an unambiguous robot name may be left out.

    InputError names `what`: there is none, there are several, it moves on its own, or is named
    twice.
    """
    known = index_joints(scene)
    return check_distinct_joints(
        scene, [_find_joint(scene, known, name, what) for name in names], what
    )


def _find_joint(scene: Scene, known: dict[str, JointIndices], name: str, what: str) -> JointIndices:
    full = [full for full in known if name in (full, full.split(".", 1)[1])]
    if len(full) > 1:
        raise InputError(f"{what}: which joint {name!r}? There are {', '.join(full)}")
    if not full:
        alone = len(scene.robots) == 1
        exist = [each.split(".", 1)[1] if alone else each for each in known]
        raise InputError(
            f"{what}: no joint {name!r} with a coordinate and a velocity of its own; "
            f"{suggest_names(name, exist, 'joints')}"
        )
    axis = known[full[0]]
    if scene.prescribed[axis.velocity]:
        raise InputError(f"{what}: '{name}' moves on its own; a task cannot command it as well")
    return axis


def select_joints(scene: Scene, names: tuple[str, ...] | None) -> list[JointIndices]:
    """Return joints by their names, or by those of robots, in that order; all for None."""
    robots = [robot.name for robot in scene.robots]
    found: list[JointIndices] = []
    for name in robots if names is None else names:
        if name in robots:
            own = [axis for full, axis in index_joints(scene).items() if full.split(".")[0] == name]
            free = [axis for axis in own if not scene.prescribed[axis.velocity]]
            if names is not None and not free:
                raise InputError(f"joints: robot '{name}' has none that a task can command by name")
            found += free
        else:
            found += find_joints(scene, [name], "joints")
    if not found:
        raise InputError("the scene has no joint with a coordinate and a velocity of its own")
    return check_distinct_joints(scene, found, "joints")


def check_distinct_joints(scene: Scene, axes: list[JointIndices], what: str) -> list[JointIndices]:
    """Return the axes; InputError if one is named twice."""
    if len(set(axes)) < len(axes):
        twice = min(axis for axis in axes if axes.count(axis) > 1)
        raise InputError(f"{what}: '{scene.velocity_names[twice.velocity]}' is named twice")
    return axes
