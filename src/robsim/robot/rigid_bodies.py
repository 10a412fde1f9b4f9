"""Rigid bodies on driven joints, as tables for the dynamics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.geometry.inertia import Inertia
from robsim.robot.tree import Tree

DRIVABLE = ("revolute", "prismatic")


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """Bodies that driven joints move, each with its joint, and the carriers below them.

    Attributes
    ----------
    carriers : tuple of int
        Bodies of the tree whose motion is given; the world is body 0.
    bodies : tuple of int
        Bodies of the tree that the n joints move, parents first.
    parents : tuple of int
        Index of the parent of each body, among the carriers and then the bodies.
    columns : tuple of int
        Index of each body's joint among the joints.
    turns : tuple of bool
        Whether each joint turns.
    place : ndarray of shape (n, 3, 4) or (n, 3, 4, runs)
        Pose of each joint in the parent body.
    inertias : ndarray of shape (n, 10) or (n, 10, runs)
        Mass, first moments, and second moments xx, xy, xz, yy, yz, zz about the body's origin.
    """

    carriers: tuple[int, ...]
    bodies: tuple[int, ...]
    parents: tuple[int, ...]
    columns: tuple[int, ...]
    turns: tuple[bool, ...]
    place: Array
    inertias: Array

    @classmethod
    def of(
        cls, tree: Tree, inertias: Iterable[tuple[str, Inertia]], velocities: Sequence[int]
    ) -> RigidBodies:
        """Return the bodies that some velocities of a tree move.

        Parameters
        ----------
        tree : Tree
            Tree of frames.
        inertias : iterable of (str, Inertia)
            Frames of the tree and inertias on them. Inertias on other bodies have no effect.
        velocities : sequence of int
            Indices of the velocities of the joints, in the order of the joints.

        Raises
        ------
        InputError
            If a joint of another kind moves on a driven joint.
        """
        joint = {int(tree.owners[v]): i for i, v in enumerate(velocities)}
        bodies = sorted(joint)
        _check_chain(tree, joint)
        carriers = sorted({int(tree.parent[body]) for body in bodies} - joint.keys())
        number = {body: i for i, body in enumerate([*carriers, *bodies])}
        place = np.asarray(tree.joints.place)[bodies]
        return cls(
            tuple(carriers),
            tuple(bodies),
            tuple(number[int(tree.parent[body])] for body in bodies),
            tuple(joint[body] for body in bodies),
            tuple(tree.models[body].name == "revolute" for body in bodies),
            make_read_only(np.ascontiguousarray(place)),
            make_read_only(_sum_inertias(tree, inertias, bodies)),
        )

    def locate(self, tree: Tree, frame: str) -> tuple[int, Array] | None:
        """Return the index of the body that carries a frame, and the frame's pose in the body."""
        body, offset = tree.find(frame)
        return (self.bodies.index(body), offset) if body in self.bodies else None


def measure_moments(inertia: Inertia, offset: Array) -> Array:
    """Return mass, first and second moments (10,) of an inertia about the origin of a body.

    `offset` (..., 4, 4) is the pose of the frame of the inertia in the body; the result has the
    shape (10,) or (10, runs).
    """
    R, p = offset[..., :3, :3], offset[..., :3, 3]
    c = (R @ inertia.centre) + p
    square = np.sum(c * c, axis=-1)[..., None, None] * np.eye(3) - c[..., :, None] * c[..., None, :]
    tensor = R @ inertia.tensor @ np.swapaxes(R, -1, -2) + inertia.mass * square
    first, second = inertia.mass * c, tensor[..., *np.triu_indices(3)]
    mass = np.full((*c.shape[:-1], 1), inertia.mass)
    return np.moveaxis(np.concatenate([mass, first, second], axis=-1), -1, 0)


def _sum_inertias(
    tree: Tree, inertias: Iterable[tuple[str, Inertia]], bodies: Sequence[int]
) -> Array:
    """Return the moments (n, 10) or (n, 10, runs) of bodies."""
    total = np.zeros((len(bodies), 10))
    for name, inertia in inertias:
        body, offset = tree.find(name)
        if body not in bodies:
            continue
        moments = measure_moments(inertia, offset)
        if moments.ndim == 2 and total.ndim == 2:
            total = np.repeat(total[..., None], moments.shape[1], axis=2)
        total[bodies.index(body)] += moments if moments.ndim == total.ndim - 1 else moments[:, None]
    return total


def _check_chain(tree: Tree, joint: dict[int, int]) -> None:
    """Raise InputError for a joint that is not driven, on a body that a driven joint moves."""
    for body in range(1, len(tree.parent)):
        kind, parent = tree.models[body], int(tree.parent[body])
        if body in joint and kind.name not in DRIVABLE:
            raise InputError(f"a {kind.name} joint has no dynamics; revolute and prismatic have")
        if body not in joint and parent in joint:
            raise InputError(
                f"a {kind.name} joint moves on a joint with dynamics, which is not supported"
            )
