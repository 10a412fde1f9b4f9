"""The controller that keeps a frame on a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, numbers
from robsim.kernels.control import commanding, following
from robsim.kernels.control import path_following as kernels
from robsim.kernels.machine.program import Blocks
from robsim.kernels.machine.rows import Rows
from robsim.robot.placed import Placed
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.given import Commanded, Given
from robsim.servo.laws.inverse import Inverse, inverted, rank
from robsim.servo.placed_frame import jacobian_in_world, placed_at, prescribed_rates
from robsim.servo.shaping.shaped import Columns
from robsim.servo.shaping.shaping import Shapeable, Shaping
from robsim.servo.tasks.followed import Followed, followed
from robsim.servo.tasks.follower import Follower
from robsim.trajectory.pace import Pace
from robsim.trajectory.timing import ALIKE
from robsim.world.scene import Scene


class FrameRows(NamedTuple):
    """The rows of the frame that is moved, of the end of its path, and room for its stages."""

    placed: Placed
    T: Rows  # (3, 4) in the world
    J: Rows  # (6, n) in world axes, by the commanded velocities
    end: Rows  # (3, 4) of the path
    room: Rows


@dataclass(frozen=True, eq=False)
class PathFollower(Follower):
    """The controller of `FollowPath`."""

    path: Any  # the same for all runs; None: straight from where each of them starts to the end
    way_pace: Pace | None  # of a straight way
    end: Array  # (3, 4) of the path
    inverse: Inverse
    shaping: Shaping

    def stages(self, given: Given) -> Commanded:
        """Add the stages of an instant to a program, and return the rows that they write."""
        program, k, n = given.program, self.k, self.columns.size
        of = self._frame(given)
        whole, L, error = program.rows(6), program.rows(3, 6), program.rows(k)
        s = whole[:k]
        program.add(kernels.missed, T=of.T, end=of.end, room=of.room, s=whole, L=L)
        program.add(
            commanding.difference, s=s, s_goal=program.constant(np.ravel(self.s_goal)), error=error
        )
        A = self._task_jacobian(given, of.J, L)
        way = self._straight(given, of) if self.path is None else self._along(given)
        V = self._twist(given, of, way)
        qd = inverted(program, of.J[:k], V[:k], self.inverse)
        qd = self.shaping.stages(given, Shapeable(k, n, error, of.J, A, qd))

        def decide(blocks: Blocks) -> Decision:
            return Decision(Command(*map(blocks.get, (s, error, qd, A))), blocks.get(of.J))

        return Commanded(s, error, qd, A, self.busy(given, way), decide, lambda qd: None)

    def _frame(self, given: Given) -> FrameRows:
        """Add the stages of the frame and of its Jacobians."""
        tree, program = self.scene.tree, given.program
        placed = given.placed or placed_at(program, tree, given.q)
        (T,) = placed.frames([tree.find(self.frame)])
        J = jacobian_in_world(placed, tree, self.frame, T, self.columns)
        return FrameRows(placed, T, J, program.constant(self.end), program.rows(kernels.ROOM))

    def _task_jacobian(self, given: Given, J: Rows, L: Rows) -> Rows:
        """Return the rows of how the joints move s (k, n), with L of the turn."""
        if self.k == 3:
            return J[:3]
        n, program = self.columns.size, given.program
        A = program.rows(6, n)
        program.add(commanding.copied, rows=J[:3].flat, to=A[:3].flat)
        program.add(commanding.product, L=L, J=J, A=A[3:])
        return A

    def _twist(self, given: Given, of: FrameRows, way: Followed) -> Rows:
        """Return the rows of the twist that the joints are to give the frame, in world axes.

        It is the one that takes the frame on, without what prescribed motions give it anyway.
        """
        program, scene = given.program, self.scene
        V = program.rows(6)
        program.add(
            kernels.twist,
            T=of.T,
            here=way.here.reshape(2, 3, 4),
            gain=self.gain_row(given),
            duration=given.dt,
            room=of.room,
            wanted=program.rows(3, 4),
            V=V,
        )
        if not scene.motions:
            return V
        prescribed = np.flatnonzero(scene.prescribed)
        J = jacobian_in_world(of.placed, scene.tree, self.frame, of.T, prescribed)
        rates, drift = prescribed_rates(given, scene, prescribed), program.rows(6)
        rest = program.rows(6)
        program.add(commanding.along, A=J, x=rates, out=drift)
        program.add(commanding.difference, s=V, s_goal=drift, error=rest)
        return rest

    def _along(self, given: Given) -> Followed:
        """Add the stages of a path that is the same for all runs."""

        def at(t: Any) -> Array:
            T = numbers(self.path.at(t), "path.at", (4, 4))
            return T[..., :3, :].reshape(*T.shape[:-2], 12)

        return followed(given, self.path, 12, at)

    def _straight(self, given: Given, of: FrameRows) -> Followed:
        """Add the stages of the path of each run, from where its frame started."""
        program, dt = given.program, given.dt
        start, goal, way = program.rows(3, 4), of.end, program.rows(8)
        program.add(following.remembered, to=start.flat, rows=list(of.T.flat))
        if self.k == 3:  # as it is turned at the start
            goal = program.rows(3, 4)
            turned = [(of.end if i % 4 == 3 else start).flat[i] for i in range(12)]
            program.add(following.remembered, to=goal.flat, rows=turned)
        program.add(kernels.apart, start=start, goal=goal, room=of.room, way=way)
        seconds, ramps = self._timing(given, way[6:])
        here = program.rows(2, 3, 4)
        program.add(
            kernels.straight,
            dt=dt,
            seconds=seconds,
            ramps=ramps,
            start=start,
            way=way,
            goal=goal,
            room=of.room,
            here=here,
        )
        return Followed(here, seconds)

    def _timing(self, given: Given, ways: Rows) -> tuple[Rows, Rows]:
        """Return the rows of the duration of a distance and an angle, and of their ramps."""
        assert self.way_pace is not None
        program = given.program
        if self.way_pace.duration is not None:
            return program.constant(self.way_pace.duration), program.constant([ALIKE, ALIKE])
        seconds, ramps = program.rows(), program.rows(2)
        program.add(
            following.paced,
            ways=ways,
            limits=program.constant(np.reshape(self.way_pace.limits, (2, 2))),
            ramps=ramps,
            seconds=seconds,
        )
        return seconds, ramps


def usual_rank(scene: Scene, frame: str, columns: Columns, k: int) -> int:
    """Return the rank of J (k, n) away from singularities.

    It is the largest at home and where every joint has moved a little.
    """
    places = [
        np.concatenate([np.empty(0), *(_moved(robot, far) for robot in scene.robots)])
        for far in (0.0, 0.1, 0.3)
    ]
    tree = scene.tree
    J = tree.jacobian(tree.bodies(np.array(places).T.copy()), frame)
    return int(rank(np.ascontiguousarray(J[:k][:, columns])).max())


def _moved(robot: Any, far: float) -> Array:
    """Return coordinates (nq,) of a robot whose velocities were held for a while from home."""
    rates = far * (1.0 + 0.1 * np.arange(robot.nv))
    moved: Array = robot.integrate(robot.home, rates, 1.0)
    return moved
