"""The kinematic tree: where its frames are, and how its velocities move them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.base.errors import FrameError, suggest
from robsim.kernels import tree as kernels
from robsim.robot.assembly import Assembly, Frame, integers
from robsim.robot.joint import Steering


class Tree:
    """Constants of a tree of frames, in the kernels' form. Body 0 is the world.

    A moving joint starts a new body; its tail and every fixed joint behind it are folded into
    constant offsets, so that only joints that move cost anything.
    """

    def __init__(self, frames: Iterable[Frame]):
        built = Assembly(list(frames))
        self.nq, self.nv = built.nq, built.nv
        self.where: dict[str, tuple[int, Array]] = built.where
        self.joints: kernels.Joints = built.joints()
        columns = (kernels.PARENT, kernels.KIND, kernels.IQ, kernels.IV)
        # of each body, its parent, kind, and first coordinate and velocity of its own, or -1
        self.parent, self.kind, self.iq, self.iv = (self.joints.rows[:, c] for c in columns)
        # of each move: its velocity, body, whether it turns, axis, ratio; by velocity, then body
        self.moved = integers(np.array(sorted(built.moves), dtype=np.int64).reshape(-1, 5))
        self.velocity, self.body = self.moved[:, 0], self.moved[:, 1]
        self._moves_of: dict[str, kernels.Moves] = {}  # a frame, once it was asked for
        self.cars: tuple[tuple[int, int, Steering], ...] = tuple(built.cars)

    def find(self, name: str) -> tuple[int, Array]:
        """The body that carries a frame, and the frame's constant pose in it."""
        if name not in self.where:
            raise FrameError(f"no frame {name!r}; {suggest(name, self.where, 'frames')}")
        return self.where[name]

    def room(self, runs: int) -> kernels.Bodies:
        """Bodies that are not placed yet."""
        poses = np.empty((len(self.kind), 3, 4, runs))
        return kernels.Bodies(poses, np.empty((self.joints.ratios, runs)))

    def bodies(self, q: Array) -> kernels.Bodies:
        """Where all bodies are at coordinates q[n, b]."""
        out = self.room(q.shape[1])
        kernels.bodies(self.joints, q, out)
        return out

    def frame(self, bodies: kernels.Bodies, name: str) -> Array:
        """T[3, 4, b] of a frame."""
        body, offset = self.find(name)
        T = np.empty(bodies.poses.shape[1:])
        kernels.frame(bodies.poses, body, offset, T)
        return T

    def jacobian(self, bodies: kernels.Bodies, name: str) -> Array:
        """J[6, j, b] of a frame's origin in world axes."""
        J = np.empty((6, self.nv, bodies.poses.shape[3]))
        point = np.ascontiguousarray(self.frame(bodies, name)[:, 3])
        if name not in self._moves_of:
            self._moves_of[name] = self.moves(self.carried(name))
        kernels.jacobian(bodies, point, self._moves_of[name], J)
        return J

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move q[n, b] by velocities v[m, b] held for dt, after cars have steered for them."""
        self.steer(q, v, dt)
        self.roll(q, v, dt)

    def steer(self, q: Array, v: Array, dt: float) -> None:
        """Turn the wheels of cars, as far as they get in a period of dt."""
        for row, velocity, s in self.cars:
            kernels.steer(row, velocity, s.wheelbase, s.limit, s.rate, dt, q, v)

    def roll(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] by velocities v[m, b], cars as they have steered."""
        kernels.integrate(self.joints, self.driven(q, v), seconds, q)

    def driven(self, q: Array, v: Array) -> Array:
        """The velocities v[m, b] as the steering angles of cars allow them."""
        if self.cars:
            v = v.copy()
        for row, velocity, s in self.cars:
            kernels.obey(row, velocity, s.wheelbase, q, v)
        return v

    def carried(self, name: str) -> Array:
        """1.0 for each move that the frame takes part in, else 0.0."""
        rides: Array = self._ancestry[self.find(name)[0]]
        return rides

    def carries(self, name: str) -> Array:
        """1.0 for each velocity that moves the frame, else 0.0."""
        found = np.zeros(self.nv)
        np.maximum.at(found, self.velocity, self.carried(name))
        return frozen(found)

    def moves(self, sign: Array, columns: NDArray[np.int64] | None = None) -> kernels.Moves:
        """For the kernels: what some velocities move (all by default), each move with its sign."""
        if columns is None:
            columns = integers(np.arange(self.nv))
        chosen = np.isin(self.velocity, columns)
        rows = self.moved[chosen]
        rows[:, 0] = np.searchsorted(columns, rows[:, 0])
        return kernels.Moves(columns, frozen(rows), frozen(sign[chosen]))

    def alone(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of each of some velocities, the only coordinate that it changes, or -1."""
        single = np.isin(self.kind, (kernels.REVOLUTE, kernels.PRISMATIC, kernels.RAIL))
        found = np.full(self.nv, -1)
        mine = single & (self.iv >= 0)
        found[self.iv[mine]] = self.iq[mine]
        return integers(found[columns])

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """(nv,) the body whose joint has each velocity."""
        found = np.empty(self.nv, dtype=np.int64)
        for body in np.argsort(self.iv, kind="stable"):
            if self.iv[body] >= 0:
                found[self.iv[body] :] = body  # until the next one begins
        return frozen(found)

    @property
    def kinds(self) -> NDArray[np.int64]:
        """(nv,) the kind of that joint, see `robsim.kernels.tree`."""
        kinds: NDArray[np.int64] = self.kind[self.owners]
        return kinds

    @cached_property
    def _ancestry(self) -> Array:
        """[body, move]: whether the move carries the body."""
        rows = np.zeros((len(self.parent), len(self.body)))
        for i in range(1, len(self.parent)):
            rows[i] = rows[self.parent[i]] + (self.body == i)
        return frozen(rows)
