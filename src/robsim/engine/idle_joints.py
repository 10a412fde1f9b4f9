"""Joints that nothing moves during a run, and the bodies that stand still with them."""

from __future__ import annotations

from collections.abc import Set

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.robot.assembly import JointTables
from robsim.robot.independent_joint import IndependentJoint
from robsim.world.scene import Scene


def find_idle_coordinates(scene: Scene, columns: NDArray[np.int64], q0: Array) -> dict[int, int]:
    """Return the velocity of each coordinate that keeps its value, the same in all runs.

    Nobody commands or prescribes its velocity, so that q + 0 dt has the bits of q. Joints with a
    motion of their own, such as vehicles and free bodies, are not among them: their integration may
    round.

    Parameters
    ----------
    scene : Scene
        Scene without drives and without errors of the commands.
    columns : ndarray of int
        Indices of the commanded velocities.
    q0 : ndarray of shape (runs, nq)
        Coordinates at the start.
    """
    moved = scene.prescribed.copy()
    moved[columns] = True
    same = (q0 == q0[0]).all(axis=0) & ~np.signbit(q0).any(axis=0, where=q0 == 0.0)
    members = filter(_is_straight, scene.tree.joints.members)
    pairs = [(each.q.start, each.v.start) for each in members]
    return {q: v for q, v in pairs if same[q] and not moved[v]}


def place_idle_bodies(scene: Scene, idle: Set[int], q0: Array) -> dict[int, Array]:
    """Return the poses (3, 4) of the bodies that only idle joints carry."""
    joints = scene.tree.joints
    if not idle or joints.place.ndim > 3:  # each run has places of its own
        return {}
    bodies = _find_still_bodies(joints, idle)
    poses = scene.tree.bodies(np.ascontiguousarray(q0[:1].T)).poses[..., 0] if bodies else []
    return {body: poses[body] for body in bodies}


def _find_still_bodies(joints: JointTables, idle: Set[int]) -> list[int]:
    """Return the bodies whose joint and whose parents stand still; parents come first."""
    straight = {each.body for each in joints.members if _is_straight(each)}
    still = {0}
    for i, body in enumerate(joints.bodies):
        if i in straight and body.x in idle and body.parent in still:
            still.add(i)
    return sorted(still - {0})


def _is_straight(joint: IndependentJoint) -> bool:
    """Return whether a joint is built in, with one coordinate and its rate."""
    counts = joint.q.stop - joint.q.start, joint.v.stop - joint.v.start
    return counts == (1, 1) and joint.kind.moving is None and not (joint.kind.own or joint.rolls)
