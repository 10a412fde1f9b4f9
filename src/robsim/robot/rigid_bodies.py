"""Rigid bodies of a kinematic tree: the tables of the algorithms of dynamics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.dynamics.body_rows import FLOATING, PRISMATIC, REVOLUTE
from robsim.robot.joints.joint_kind import JointKind
from robsim.robot.joints.mimic import Mimic
from robsim.robot.tree import Tree

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, in axes of the world
Gravity = Sequence[float] | Array
KINDS = {"revolute": REVOLUTE, "prismatic": PRISMATIC, "floating": FLOATING}


@dataclass(frozen=True)
class RigidBody:
    """Body of a tree, with the joint that moves it.

    Attributes
    ----------
    parent : int
        Index of the parent, among the carriers and then the bodies.
    kind : int
        Kind of the joint, see `robsim.kernels.dynamics.body_rows`.
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
    coordinate: int
    velocity: int
    ratio: float = 1.0
    offset: float = 0.0
    mimics: bool = False


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """Bodies with inertias, which some joints of a tree move, and the carriers below them.

    The joints are revolute, prismatic or floating, or mimic such a joint. The motion of a carrier
    is given: the world, or a body that stands on it by joints that forces do not move.

    Attributes
    ----------
    carriers : tuple of int
        Indices of the carriers in the tree; the world is body 0.
    bodies : tuple of RigidBody
        Bodies on joints, parents first.
    place : ndarray of shape (bodies, 3, 4) or (bodies, 3, 4, runs)
        Poses of the joints in the parent bodies.
    inertias : ndarray of shape (bodies, 10) or (bodies, 10, runs)
        Mass m (kg), first moment m c (kg m) and moments xx, xy, xz, yy, yz, zz (kg m^2) about the
        origin of the body, in its axes.
    nq, n : int
        Number of coordinates and velocities of the joints.
    """

    carriers: tuple[int, ...]
    bodies: tuple[RigidBody, ...]
    place: Array
    inertias: Array
    nq: int
    n: int

    @classmethod
    def of(
        cls,
        tree: Tree,
        inertias: Iterable[tuple[str, Inertia]],
        velocities: Sequence[int] | None = None,
    ) -> RigidBodies:
        """Return the bodies that some velocities of a tree move by forces.

        Parameters
        ----------
        tree : Tree
            Tree of a robot or a scene.
        inertias : iterable of (str, Inertia)
            Frames with their inertias. Several inertias of a body are added, and inertias on
            carriers have no effect.
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
            If a joint has another kind, or if a body with an inertia and a given motion stands on
            a body that forces move.
        """
        columns = list(range(tree.nv)) if velocities is None else list(velocities)
        chosen = _BodyChoice(tree, columns)
        index = {each.tree_body: i for i, each in enumerate(chosen.bodies)}
        return cls(
            tuple(chosen.carriers),
            tuple(chosen.bodies),
            make_read_only(tree.joints.place[list(index)]),
            make_read_only(chosen.sum_moments(index, list(inertias))),
            chosen.nq,
            len(columns),
        )

    def locate(self, tree: Tree, frame: str) -> tuple[int, Array] | None:
        """Return the index of the body that carries a frame, and the frame's pose in the body.

        None if no joint moves the frame.
        """
        body, offset = tree.find(frame)
        index = {each.tree_body: i for i, each in enumerate(self.bodies)}
        return (index[body], offset) if body in index else None

    @cached_property
    def has_mimics(self) -> bool:
        """Whether several bodies move by one velocity."""
        return any(each.mimics for each in self.bodies)

    @cached_property
    def has_floating(self) -> bool:
        """Whether a joint is floating."""
        return any(each.kind == FLOATING for each in self.bodies)


class _BodyChoice:
    """Choice of the carriers and bodies of a tree, and of the coordinates of the joints."""

    def __init__(self, tree: Tree, columns: list[int]) -> None:
        self.tree, self.nq = tree, 0
        self.coordinates: dict[int, int] = {}  # by the first coordinate in the tree
        self.velocities = {column: i for i, column in enumerate(columns)}
        self._number_coordinates(columns)
        moved = self._find_moved_bodies()
        self.lost = self._find_lost_bodies(set(moved))
        parents = {body: int(tree.parent[body]) for body in moved}
        for parent in parents.values():
            if parent in self.lost:
                raise InputError(self._describe_lost(parent))
        self.carriers = sorted(set(parents.values()) - moved.keys())
        order = {body: i for i, body in enumerate([*self.carriers, *moved])}
        self.bodies = [replace(joint, parent=order[parents[body]]) for body, joint in moved.items()]

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
        for i, body in enumerate(tree.joints.bodies[1:], 1):
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

    def sum_moments(self, index: dict[int, int], inertias: list[tuple[str, Inertia]]) -> Array:
        """Return the moments (bodies, 10) or (bodies, 10, runs); `index` numbers the bodies."""
        rows = []
        for name, inertia in inertias:
            body, pose = self._find_moved_body(*self.tree.find(name))
            if body in self.lost:
                raise InputError(self._describe_lost(body))
            if body in index:
                rows.append((index[body], measure_moments(inertia, pose)))
        runs = max((moments.shape[1:] for _, moments in rows), key=len, default=())
        total = np.zeros((len(index), 10, *runs))
        for i, moments in rows:
            total[i] += moments if moments.ndim == total.ndim - 1 else moments[:, None]
        return total

    def _find_moved_body(self, body: int, pose: Array) -> tuple[int, Array]:
        """Return the body that forces move below a coupled body, and the pose of a frame in it.

        A coupled body, such as a wheel that rolls, counts as fixed at its coordinate zero.
        """
        tree = self.tree
        while body in self.lost and tree.joints.bodies[body].x >= tree.nq:
            place = tree.joints.place[body]
            T = homogeneous_matrix(place.reshape(3, 4, -1), (-1,) * (place.ndim - 2))
            pose, body = T @ pose, int(tree.parent[body])
        return body, pose

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


def measure_moments(inertia: Inertia, pose: Array) -> Array:
    """Return mass, first moment and moments of an inertia about the origin of a body.

    The moments about the origin of a body follow from the parallel axis theorem,
    I_O = R I R' + m (c'c 1 - c c').

    Parameters
    ----------
    inertia : Inertia
        Inertia in the frame. Its mass may differ from run to run.
    pose : ndarray of shape (..., 4, 4)
        Poses of the frame in the body.

    Returns
    -------
    ndarray of shape (10,) or (10, ...)
        Entries of `RigidBodies.inertias`.
    """
    R, mass = pose[..., :3, :3], np.asarray(inertia.mass, dtype=np.float64)  # () or (runs,)
    m = mass[..., None]
    c = (R * inertia.centre).sum(axis=-1) + pose[..., :3, 3]
    first = (R[..., :, :, None] * inertia.tensor).sum(axis=-2)
    tensor = (first[..., :, None, :] * R[..., None, :, :]).sum(axis=-1)
    tensor = tensor + m[..., None] * ((c * c).sum(axis=-1)[..., None, None] * np.eye(3))
    tensor = tensor - m[..., None] * c[..., :, None] * c[..., None, :]
    rows, columns = np.triu_indices(3)
    masses = np.broadcast_to(m, (*tensor.shape[:-2], 1))
    result = np.concatenate([masses, m * c, tensor[..., rows, columns]], axis=-1)
    return np.moveaxis(result, -1, 0)
