"""Joints by name: those with one coordinate and one velocity of their own."""

from __future__ import annotations

from typing import NamedTuple

from robsim.errors import InputError, suggest
from robsim.scene import Scene


class Axis(NamedTuple):
    """A joint among the velocities and the coordinates of a scene."""

    velocity: int
    coordinate: int


def axes_of(scene: Scene) -> dict[str, Axis]:
    """Every such joint by its name with that of its robot, such as "panda.link3"."""
    found: dict[str, Axis] = {}
    velocity = coordinate = 0
    for robot in scene.robots:
        names = list(robot.coordinate_names)
        for i, name in enumerate(robot.velocity_names):
            if name in names:
                axis = Axis(velocity + i, coordinate + names.index(name))
                found[f"{robot.name}.{name}"] = axis
        velocity, coordinate = velocity + robot.nv, coordinate + robot.nq
    return found


def axis_named(scene: Scene, name: str, what: str) -> Axis:
    """The joint of a name, in which that of its robot may be left out where there is one only.

    InputError names `what`: there is none, there are several, or it moves on its own.
    """
    known = axes_of(scene)
    fits = [full for full in known if name in (full, full.split(".", 1)[1])]
    if len(fits) > 1:
        raise InputError(f"{what}: which joint {name!r}? There are {', '.join(fits)}")
    if not fits:
        alone = len(scene.robots) == 1
        exist = [full.split(".", 1)[1] if alone else full for full in known]
        raise InputError(
            f"{what}: no joint {name!r} with a coordinate and a velocity of its own; "
            f"{suggest(name, exist, 'joints')}"
        )
    axis = known[fits[0]]
    if scene.prescribed[axis.velocity]:
        raise InputError(f"{what}: '{name}' moves on its own; a task cannot command it as well")
    return axis


def axes_named(scene: Scene, names: tuple[str, ...] | None) -> list[Axis]:
    """Joints by their names, or by those of robots, in that order; None is for all."""
    robots = [robot.name for robot in scene.robots]
    found: list[Axis] = []
    for name in robots if names is None else names:
        if name in robots:
            own = [axis for full, axis in axes_of(scene).items() if full.split(".")[0] == name]
            free = [axis for axis in own if not scene.prescribed[axis.velocity]]
            if names is not None and not free:
                raise InputError(f"joints: robot '{name}' has none that a task can command by name")
            found += free
        else:
            found.append(axis_named(scene, name, "joints"))
    if not found:
        raise InputError("the scene has no joint with a coordinate and a velocity of its own")
    return distinct(scene, found, "joints")


def distinct(scene: Scene, axes: list[Axis], what: str) -> list[Axis]:
    """The same; InputError if one is named twice."""
    twice = {axis for axis in axes if axes.count(axis) > 1}
    if twice:
        raise InputError(f"{what}: '{scene.velocity_names[min(twice).velocity]}' is named twice")
    return axes
