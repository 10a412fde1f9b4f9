"""The controller that keeps a frame on a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, numbers
from robsim.kernels.control import commanding, following
from robsim.kernels.control import path_following as kernels
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.rows import Rows
from robsim.robot.placed import Placed
from robsim.servo.given import Commanded, Given
from robsim.servo.laws.inverse import inverted, rank
from robsim.servo.placed_frame import placed_at, prescribed_rates
from robsim.servo.shaping.shaped import Columns
from robsim.servo.shaping.shaping import Shaping
from robsim.servo.tasks.follower import Followed, Follower, followed, timing
from robsim.trajectory.pace import Pace
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class PathFollower(Follower):
    """The controller of `FollowPath`."""

    way_pace: Pace | None  # of a straight way, from where each of the runs starts to the end
    end: Array  # (3, 4) of the path
    shaping: Shaping

    def stages(self, given: Given) -> Commanded:
        """Add the stages of an instant to a program, and return the rows that they write."""
        program, k, tree = given.program, self.k, self.scene.tree
        placed = given.placed or placed_at(program, tree, given.q)
        (T,) = placed.frames([tree.find(self.frame)])
        J, end = self._jacobian(placed, T, self.columns), program.constant(self.end)
        whole, L, room = program.rows(6), program.rows(3, 6), program.scratch(kernels.ROOM)
        program.add(kernels.missed, T=T, end=end, room=room, s=whole, L=L)
        s, goal = whole[:k], program.constant(np.ravel(self.s_goal))
        error = program.result(commanding.difference, "error", k, s=s, s_goal=goal)
        A = self._task_jacobian(program, J, L)
        way = self._straight(given, T, end) if self.task.path is None else self._along(given)
        V = self._twist(given, placed, T, way)
        qd = inverted(program, J[:k], V[:k], self.task.inverse)
        qd = self.shaping.stages(given, qd, error, J, A)
        return Commanded(s, error, qd, A, self.busy(given, way), lambda blocks: blocks.get(J))

    def _jacobian(self, placed: Placed, T: Rows, columns: Columns) -> Rows:
        """Return the rows of J (6, n) of the frame at T in world axes, by some velocities."""
        moves = self.scene.tree.moves(self.scene.tree.carried(self.frame), columns)
        return placed.base_jacobian(T, moves)

    def _task_jacobian(self, program: Program, J: Rows, L: Rows) -> Rows:
        """Return the rows of how the joints move s (k, n), with L of the turn."""
        if self.k == 3:
            return J[:3]
        A = program.rows(*J.shape)
        program.add(commanding.copied, rows=J[:3].flat, to=A[:3].flat)
        program.add(commanding.product, L=L, J=J, A=A[3:])
        return A

    def _twist(self, given: Given, placed: Placed, T: Rows, way: Followed) -> Rows:
        """Return the rows of the twist that the joints are to give the frame, in world axes.

        It is the one that takes the frame on, without what prescribed motions give it anyway.
        """
        program, scene = given.program, self.scene
        V = program.result(
            kernels.twist,
            "V",
            6,
            T=T,
            here=way.here.reshape(2, 3, 4),
            gain=self.gain_row(given),
            duration=given.dt,
            room=program.scratch(kernels.ROOM),
            wanted=program.rows(3, 4),
        )
        if not scene.motions:
            return V
        prescribed = np.flatnonzero(scene.prescribed)
        J, rates = self._jacobian(placed, T, prescribed), prescribed_rates(given, scene, prescribed)
        drift = program.result(commanding.along, "out", 6, A=J, x=rates)
        return program.result(commanding.difference, "error", 6, s=V, s_goal=drift)

    def _along(self, given: Given) -> Followed:
        """Add the stages of a path that is the same for all runs."""

        def at(t: Any) -> Array:
            T = numbers(self.task.path.at(t), "path.at", (4, 4))
            return T[..., :3, :].reshape(*T.shape[:-2], 12)

        return followed(given, self.task.path, 12, at)

    def _straight(self, given: Given, T: Rows, end: Rows) -> Followed:
        """Add the stages of the path of each run, from where its frame at T started."""
        assert self.way_pace is not None
        program, goal, room = given.program, end, given.program.scratch(kernels.ROOM)
        start = program.result(following.remembered, "to", 12, rows=list(T.flat)).reshape(3, 4)
        if self.k == 3:  # as it is turned at the start
            turned = [(end if i % 4 == 3 else start).flat[i] for i in range(12)]
            goal = program.result(following.remembered, "to", 12, rows=turned).reshape(3, 4)
        way = program.result(kernels.apart, "way", 8, start=start, goal=goal, room=room)
        pace = self.way_pace
        limits = None if pace.duration is not None else np.reshape(pace.limits, (2, 2))
        times = timing(program, way[6:], pace.duration, limits)
        ends = {"start": start, "way": way, "goal": goal, "room": room}
        here = program.result(kernels.straight, "here", 2, 3, 4, dt=given.dt, **times, **ends)
        return Followed(here, times["seconds"])


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
