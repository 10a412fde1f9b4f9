"""Joints by name, if they have one coordinate and one velocity of their own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from robsim.base.errors import InputError, suggest_names
from robsim.world.scene import Scene


class JointIndices(NamedTuple):
    """Indices of a joint among the velocities and the coordinates of a scene."""

    velocity: int
    coordinate: int


def index_joints(scene: Scene) -> dict[str, JointIndices]:
    """Return every joint of one coordinate and one velocity, by full name as "panda.link3"."""
    joints: dict[str, JointIndices] = {}
    velocity = coordinate = 0
    for robot in scene.robots:
        rows = {name: i for i, name in enumerate(robot.coordinate_names)}
        for i, name in enumerate(robot.velocity_names):
            if name in rows:
                joints[f"{robot.name}.{name}"] = JointIndices(velocity + i, coordinate + rows[name])
        velocity, coordinate = velocity + robot.nv, coordinate + robot.nq
    return joints


def find_joints(scene: Scene, names: Iterable[str], what: str) -> list[JointIndices]:
    """Return the joints with the given names; the robot name may be omitted if it is unambiguous.

    Raises InputError, which names `what`, if a joint does not exist, is ambiguous, has a
    prescribed motion, or is named twice.
    """
    joints = index_joints(scene)
    return check_distinct_joints(
        scene, [_find_joint(scene, joints, name, what) for name in names], what
    )


def _find_joint(
    scene: Scene, joints: dict[str, JointIndices], name: str, what: str
) -> JointIndices:
    """Return the joint of one name; raise InputError if it is unknown, ambiguous or prescribed."""
    full = [full for full in joints if name in (full, full.split(".", 1)[1])]
    if len(full) > 1:
        raise InputError(f"{what}: joint {name!r} is ambiguous: {', '.join(full)}")
    if not full:
        alone = len(scene.robots) == 1
        exist = [each.split(".", 1)[1] if alone else each for each in joints]
        raise InputError(
            f"{what}: no joint {name!r} with a coordinate and a velocity of its own; "
            f"{suggest_names(name, exist, 'joints')}"
        )
    axis = joints[full[0]]
    if scene.prescribed[axis.velocity]:
        raise InputError(f"{what}: '{name}' moves on its own; a task cannot command it as well")
    return axis


def select_joints(scene: Scene, names: Sequence[str] | None) -> list[JointIndices]:
    """Return joints by joint names or robot names, in that order; all joints if `names` is None."""
    robots = [robot.name for robot in scene.robots]
    axes: list[JointIndices] = []
    for name in robots if names is None else names:
        if name in robots:
            own = [axis for full, axis in index_joints(scene).items() if full.split(".")[0] == name]
            free = [axis for axis in own if not scene.prescribed[axis.velocity]]
            if names is not None and not free:
                raise InputError(
                    f"joints: robot '{name}' has no joint that a task can command by name"
                )
            axes += free
        else:
            axes += find_joints(scene, [name], "joints")
    if not axes:
        raise InputError("the scene has no joint with a coordinate and a velocity of its own")
    return check_distinct_joints(scene, axes, "joints")


def check_distinct_joints(scene: Scene, axes: list[JointIndices], what: str) -> list[JointIndices]:
    """Return the joints; raise InputError if one of them is named twice."""
    if len(set(axes)) < len(axes):
        twice = min(axis for axis in axes if axes.count(axis) > 1)
        raise InputError(f"{what}: '{scene.velocity_names[twice.velocity]}' is named twice")
    return axes
