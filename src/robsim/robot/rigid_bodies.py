"""Rigid bodies of a kinematic tree: the tables of the algorithms of dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.geometry.inertia import Inertia
from robsim.kernels.dynamics.body_rows import CARRIER, FLOATING, PRISMATIC, REVOLUTE
from robsim.robot.joints.joint_kind import JointKind
from robsim.robot.joints.mimic import Mimic
from robsim.robot.tree import Tree

KINDS = {"revolute": REVOLUTE, "prismatic": PRISMATIC, "floating": FLOATING}


@dataclass(frozen=True)
class RigidBody:
    """Body of a tree, with the joint that moves it.

    Attributes
    ----------
    parent : int
        Index of the parent among the rigid bodies.
    kind : int
        Kind of the joint, see `robsim.kernels.dynamics.body_rows`; 0 for a carrier.
    tree_body : int
        Index of the body in the tree.
    coordinate, velocity : int
        First coordinate and first velocity of the joint, or of the joint that it mimics.
    ratio, offset : float
        Numbers of a mimicking joint: coordinate = ratio * source + offset.
    mimics : bool
        Whether the joint mimics another joint.
    """

    parent: int
    kind: int
    tree_body: int
    coordinate: int = 0
    velocity: int = 0
    ratio: float = 1.0
    offset: float = 0.0
    mimics: bool = False


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """Bodies with inertias, moved by some joints of a tree.

    The first bodies are carriers, whose motion is given: the world, and bodies that stand on it by
    joints that forces do not move. Parents come before their children. The joints are revolute,
    prismatic or floating, or mimic such a joint.

    Attributes
    ----------
    bodies : tuple of RigidBody
        Bodies, carriers first; body 0 is the world.
    places : ndarray of shape (bodies, 3, 4) or (bodies, 3, 4, runs)
        Poses of the joints in the parent bodies.
    inertias : ndarray of shape (bodies, 10) or (bodies, 10, runs)
        Mass m (kg), first moment m c (kg m) and moments xx, xy, xz, yy, yz, zz (kg m^2) about the
        origin of the body, in its axes.
    where : dict of str to (int, ndarray)
        Body of each frame, and the pose (4, 4) or (runs, 4, 4) of the frame in it. Frames on other
        bodies are missing.
    nq, n : int
        Number of coordinates and velocities of the joints.
    """

    bodies: tuple[RigidBody, ...]
    places: Array
    inertias: Array
    where: dict[str, tuple[int, Array]] = field(repr=False)
    nq: int
    n: int

    @classmethod
    def of(
        cls,
        tree: Tree,
        inertias: Sequence[tuple[str, Inertia]],
        velocities: Sequence[int] | None = None,
    ) -> RigidBodies:
        """Return the bodies that some velocities of a tree move by forces.

        Parameters
        ----------
        tree : Tree
            Tree of a robot or a scene.
        inertias : sequence of (str, Inertia)
            Frames with their inertias. Several inertias of a body are added.
        velocities : sequence of int, optional
            Velocities of the joints, in the order of the result; all velocities of a floating
            joint. Other joints move their bodies ideally. Default: all velocities of the tree.

        Returns
        -------
        RigidBodies
            Bodies in the order of the algorithms.

        Raises
        ------
        InputError
            If a joint has another kind, or a body with a given motion stands on one that forces
            move.
        """
        columns = list(range(tree.nv)) if velocities is None else list(velocities)
        chosen = _BodyChoice(tree, columns)
        index = {each.tree_body: i for i, each in enumerate(chosen.bodies)}
        where = {
            name: (index[body], pose) for name, (body, pose) in tree.where.items() if body in index
        }
        places = tree.joints.place[[each.tree_body for each in chosen.bodies]]
        return cls(
            tuple(chosen.bodies),
            make_read_only(places),
            make_read_only(sum_moments(len(index), where, chosen.keep_loads(inertias))),
            where,
            chosen.nq,
            len(columns),
        )

    @cached_property
    def carriers(self) -> tuple[int, ...]:
        """Index in the tree of each carrier; the world is 0."""
        return tuple(each.tree_body for each in self.bodies if each.kind == CARRIER)

    @cached_property
    def jointed(self) -> tuple[int, ...]:
        """Index of each body on a joint."""
        return tuple(range(len(self.carriers), len(self.bodies)))

    @cached_property
    def mimics(self) -> bool:
        """Whether several bodies move by one velocity."""
        return any(self.bodies[i].mimics for i in self.jointed)

    @cached_property
    def floats(self) -> bool:
        """Whether a joint is floating."""
        return any(each.kind == FLOATING for each in self.bodies)


class _BodyChoice:
    """Choice of the bodies of a tree, carriers first, and of their coordinates."""

    def __init__(self, tree: Tree, columns: list[int]) -> None:
        self.tree, self.nq = tree, 0
        self.coordinates: dict[int, int] = {}  # by the first coordinate in the tree
        self.velocities = {column: i for i, column in enumerate(columns)}
        self._number_coordinates(columns)
        moved = self._find_moved_bodies()
        self.lost = self._find_lost_bodies(set(moved))
        count = len(tree.parent)
        carriers = [i for i in range(count) if i not in moved and i not in self.lost]
        order = {body: i for i, body in enumerate([*carriers, *moved])}
        self.bodies = [RigidBody(0, CARRIER, body) for body in carriers]
        for body, joint in moved.items():
            parent = int(tree.parent[body])
            if parent in self.lost:
                raise InputError(self._describe_lost(parent))
            self.bodies.append(replace(joint, parent=order[parent]))

    def _number_coordinates(self, columns: list[int]) -> None:
        """Assign indices to the coordinates of the joints, in the order of their velocities."""
        members = {each.v.start: each for each in self.tree.members if each.v.stop > each.v.start}
        for column in columns:
            member = members.get(column)
            if member is not None:
                self.coordinates[member.q.start] = self.nq
                self.nq += member.q.stop - member.q.start

    def _find_moved_bodies(self) -> dict[int, RigidBody]:
        """Return the bodies on chosen joints by their indices in the tree, without parents."""
        tree, moved = self.tree, dict[int, RigidBody]()
        for member in tree.members:
            if member.q.start in self.coordinates and not member.rolls:
                i, first = member.body, self.coordinates[member.q.start]
                kind = find_kind(member.kind, self._name_frame(i))
                moved[i] = RigidBody(0, kind, i, first, self.velocities[member.v.start])
        for i, body in enumerate(tree.joints.bodies):
            tie = self._follow_mimics(body.x - tree.nq) if body.x >= tree.nq else None
            if tie is not None:
                source, ratio, offset = tie
                kind = find_kind(body.kind, self._name_frame(i))
                numbers = self.coordinates[source], self._find_velocity(source)
                moved[i] = RigidBody(0, kind, i, *numbers, ratio, offset, mimics=True)
        return dict(sorted(moved.items()))

    def _follow_mimics(self, i: int) -> tuple[int, float, float] | None:
        """Return source, ratio and offset of a dependent coordinate that mimics a chosen one."""
        tree, ratio, offset, source = self.tree, 1.0, 0.0, self.tree.nq + i
        while source >= tree.nq:
            tie = tree.joints.ties[source - tree.nq]
            if not isinstance(tie.follows, Mimic):
                return None
            u, v, _ = tie.numbers
            ratio, offset, source = ratio * u, ratio * v + offset, tie.source
        return (source, ratio, offset) if source in self.coordinates else None

    def _find_velocity(self, coordinate: int) -> int:
        """Return the index of the velocity of a chosen coordinate."""
        column = next(each.v.start for each in self.tree.members if each.q.start == coordinate)
        return self.velocities[column]

    def _find_lost_bodies(self, moved: set[int]) -> set[int]:
        """Return the bodies with a given motion that stand on bodies that forces move."""
        parent, lost, carried = self.tree.parent, set[int](), set[int]()
        for body in range(1, len(parent)):
            above = int(parent[body])
            if body in moved:
                carried.add(body)
            elif above in carried or above in lost:
                lost.add(body)
        return lost

    def keep_loads(self, inertias: Sequence[tuple[str, Inertia]]) -> list[tuple[str, Inertia]]:
        """Return the inertias; raise InputError if one moves ideally on a joint with forces."""
        for name, _ in inertias:
            body, _ = self.tree.find(name)
            if body in self.lost:
                raise InputError(self._describe_lost(body))
        return list(inertias)

    def _describe_lost(self, body: int) -> str:
        kind = self.tree.models[body].name
        return (
            f"'{self._name_frame(body)}' moves by a {kind} joint with a given motion, and stands "
            "on a link that forces move: dynamics needs revolute and prismatic joints there"
        )

    def _name_frame(self, body: int) -> str:
        """Return the name of the first frame of a body."""
        return next(name for name, (own, _) in self.tree.where.items() if own == body)


def find_kind(kind: JointKind, name: str) -> int:
    """Return the number of a kind of joint; InputError for a kind that no force moves."""
    if kind.own or kind.name not in KINDS:
        raise InputError(
            f"'{name}' is on a {kind.name} joint, which has no dynamics; only revolute, prismatic "
            "and floating joints, and joints that mimic them, have"
        )
    return KINDS[kind.name]


def sum_moments(
    count: int, where: dict[str, tuple[int, Array]], inertias: Sequence[tuple[str, Inertia]]
) -> Array:
    """Return the moments (count, 10) or (count, 10, runs) of bodies that carry some inertias.

    `where` is described in `RigidBodies`.
    """
    runs = max((where[name][1].shape[:-2] for name, _ in inertias), key=len, default=())
    moments = np.zeros((count, 10, *runs))
    for name, inertia in inertias:
        body, pose = where[name]
        moments[body] += (
            move_moments(inertia, pose).T
            if pose.ndim > 2 or not runs
            else (move_moments(inertia, pose)[:, None])
        )
    return moments


def move_moments(inertia: Inertia, pose: Array) -> Array:
    """Return mass, first moment and moments (..., 10) of an inertia in a frame at poses.

    The moments about the origin of a body follow from the parallel axis theorem,
    I_O = R I R' + m (c'c 1 - c c').

    Parameters
    ----------
    inertia : Inertia
        Inertia in the frame.
    pose : ndarray of shape (..., 4, 4)
        Poses of the frame in the body.

    Returns
    -------
    ndarray of shape (..., 10)
        Rows of `RigidBodies.inertias`.
    """
    R, m = pose[..., :3, :3], inertia.mass
    c = (R * inertia.centre).sum(axis=-1) + pose[..., :3, 3]
    first = (R[..., :, :, None] * inertia.tensor).sum(axis=-2)
    tensor = (first[..., :, None, :] * R[..., None, :, :]).sum(axis=-1)
    tensor = tensor + m * ((c * c).sum(axis=-1)[..., None, None] * np.eye(3))
    tensor = tensor - m * c[..., :, None] * c[..., None, :]
    rows, columns = np.triu_indices(3)
    mass = np.broadcast_to(np.float64(m), (*c.shape[:-1], 1))
    result: Array = np.concatenate([mass, m * c, tensor[..., rows, columns]], axis=-1)
    return result
