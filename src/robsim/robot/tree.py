"""The kinematic tree: the poses of its frames, and their Jacobians."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.base.errors import FrameError, suggest
from robsim.kernels import jacobian as jacobians
from robsim.kernels import joints as motions
from robsim.kernels import packed
from robsim.kernels import tree as kernels
from robsim.robot.assembly import Assembly, integers
from robsim.robot.frame import Frame
from robsim.robot.joint import FIXED, Steering
from robsim.robot.joints.kind import JointKind
from robsim.robot.member import Member, OwnMotion


class Tree:
    """The constants of a tree of frames, in the kernels' form; body 0 is the world.

    A moving joint starts a new body; its tail and every fixed joint behind it are folded into
    constant offsets, so that only joints that move cost anything.
    """

    def __init__(self, frames: Iterable[Frame]):
        built = Assembly(list(frames))
        self.nq, self.nv = built.nq, built.nv
        self.where: dict[str, tuple[int, Array]] = built.where
        self.joints: kernels.Joints = built.joints()
        columns = (kernels.PARENT, kernels.IQ, kernels.IV)
        # of each body, its parent, and first coordinate and velocity of its own, or -1
        self.parent, self.iq, self.iv = (self.joints.rows[:, c] for c in columns)
        carriers = (frame.joint if frame else FIXED for frame in built.carriers)
        self.models: tuple[JointKind, ...] = tuple(joint.model for joint in carriers)  # of bodies
        self.members: tuple[Member, ...] = tuple(built.members)  # joints with own coordinates
        self.own: tuple[OwnMotion, ...] = tuple(built.own)  # of kinds of the user's own
        # of each move: its velocity, body, whether it turns, axis, ratio; by velocity, then body
        self.moved = integers(np.array(sorted(built.moves), dtype=np.int64).reshape(-1, 5))
        self.velocity, self.body = self.moved[:, 0], self.moved[:, 1]
        self._moves_of: dict[str, jacobians.Moves] = {}  # by frame, computed once
        self.cars: tuple[tuple[int, int, Steering], ...] = tuple(built.cars)

    @cached_property
    def packed(self) -> tuple[NDArray[np.int64], Array]:
        """The joints in two arrays, which kernels unpack."""
        arrays: tuple[NDArray[np.int64], Array] = packed.pack(self.joints)
        return arrays

    def find(self, name: str) -> tuple[int, Array]:
        """Return the body that carries a frame, and the frame's constant pose in it."""
        if name not in self.where:
            raise FrameError(f"no frame {name!r}; {suggest(name, self.where, 'frames')}")
        return self.where[name]

    def room(self, runs: int) -> kernels.Bodies:
        """Return arrays for bodies that are not placed yet."""
        poses = np.empty((len(self.parent), 3, 4, runs))
        return kernels.Bodies(poses, np.empty((self.joints.ratios, runs)))

    def bodies(self, q: Array) -> kernels.Bodies:
        """Return the poses of all bodies at coordinates q[n, b]."""
        out = self.room(q.shape[1])
        self.prepare(q, out)
        kernels.bodies(self.joints, q, out)
        return out

    @property
    def compiled(self) -> bool:
        """Whether the whole tree is compiled: no joint is of a user's own kind."""
        return not self.own

    def prepare(self, q: Array, out: kernels.Bodies) -> None:
        """Write the motions of joints of the user's kinds, before a kernel places bodies."""
        for each in self.own:
            each.put(q, out)

    def frame(self, bodies: kernels.Bodies, name: str) -> Array:
        """Return the pose T[3, 4, b] of a frame."""
        body, offset = self.find(name)
        T = np.empty(bodies.poses.shape[1:])
        kernels.frame(bodies.poses, body, offset, T)
        return T

    def jacobian(self, bodies: kernels.Bodies, name: str) -> Array:
        """Return the Jacobian J[6, j, b] of a frame's origin in world axes."""
        J = np.empty((6, self.nv, bodies.poses.shape[3]))
        point = np.ascontiguousarray(self.frame(bodies, name)[:, 3])
        if name not in self._moves_of:
            self._moves_of[name] = self.moves(self.carried(name))
        jacobians.jacobian(bodies, point, self._moves_of[name], J)
        return J

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move q[n, b] by velocities v[m, b] held for dt, after the cars have steered for them."""
        self.steer(q, v, dt)
        self.roll(q, v, dt)

    def steer(self, q: Array, v: Array, dt: float) -> None:
        """Turn the wheels of cars, as far as their steering rate allows in a period dt."""
        for row, velocity, s in self.cars:
            motions.steer(row, velocity, s.wheelbase, s.limit, s.rate, dt, q, v)

    def roll(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] by velocities v[m, b], with cars steered as they are."""
        self.flow(q, self.driven(q, v), seconds)

    def flow(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] along the motions of velocities v[m, b], without the limits of steering."""
        kernels.integrate(self.joints, v, seconds, q)
        for each in self.own:
            each.advance(q, v, seconds)

    def driven(self, q: Array, v: Array) -> Array:
        """Return the velocities v[m, b] that the steering angles of cars allow."""
        if self.cars:
            v = v.copy()
        for row, velocity, s in self.cars:
            motions.obey(row, velocity, s.wheelbase, q, v)
        return v

    def carried(self, name: str) -> Array:
        """Return 1.0 for each move that affects the frame, else 0.0."""
        rides: Array = self._ancestry[self.find(name)[0]]
        return rides

    def carries(self, name: str) -> Array:
        """Return 1.0 for each velocity that moves the frame, else 0.0."""
        found = np.zeros(self.nv)
        np.maximum.at(found, self.velocity, self.carried(name))
        return frozen(found)

    def moves(self, sign: Array, columns: NDArray[np.int64] | None = None) -> jacobians.Moves:
        """Return the moves of some velocities (default: all) with their signs, for the kernels."""
        if columns is None:
            columns = integers(np.arange(self.nv))
        chosen = np.isin(self.velocity, columns)
        rows = self.moved[chosen]
        rows[:, 0] = np.searchsorted(columns, rows[:, 0])
        return jacobians.Moves(columns, frozen(rows), frozen(sign[chosen]))

    def alone(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the only coordinate that each of some velocities changes, or -1."""
        return integers(self._alone[columns])

    @cached_property
    def _alone(self) -> NDArray[np.int64]:
        """The only coordinate (nv,) that each velocity changes, or -1."""
        found = np.full(self.nv, -1)
        for member in self.members:
            if not member.rolls:
                numbers = np.array(member.kind.alone)
                found[member.v] = np.where(numbers >= 0, member.q.start + numbers, -1)
        return integers(found)

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """The body (nv,) whose joint has each velocity."""
        found = np.empty(self.nv, dtype=np.int64)
        for body in np.argsort(self.iv, kind="stable"):
            if self.iv[body] >= 0:
                found[self.iv[body] :] = body  # until the next one begins
        return frozen(found)

    def kinds(self, columns: NDArray[np.int64]) -> list[JointKind]:
        """Return the kind of the joint that has each of some velocities."""
        return [self.models[body] for body in self.owners[columns]]

    @cached_property
    def _ancestry(self) -> Array:
        """The table [body, move] of whether the move carries the body."""
        rows = np.zeros((len(self.parent), len(self.body)))
        for i in range(1, len(self.parent)):
            rows[i] = rows[self.parent[i]] + (self.body == i)
        return frozen(rows)
