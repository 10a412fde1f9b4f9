"""The controller that keeps a frame on a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_floats
from robsim.kernels.control import axis_trajectory, control_law
from robsim.kernels.control import frame_trajectory as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.frame_rows import add_body_poses, add_prescribed_velocities
from robsim.servo.laws.inverse import add_inverse, compute_rank
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.shaping.command_shaper import CommandShaper
from robsim.servo.tasks.trajectory_follower import (
    ReferenceRows,
    TrajectoryFollower,
    add_timing,
    add_trajectory,
)
from robsim.trajectory.pace import Pace
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class PathFollower(TrajectoryFollower):
    """The controller of `FollowPath`."""

    way_pace: Pace | None  # of a straight way, from where each of the runs starts to the end
    end: Array  # (3, 4) of the path
    shaping: CommandShaper

    def stages(self, given: ControllerInputs) -> ControllerOutputs:
        """Add the stages of an instant to a program, and return the rows that they write."""
        program, k, tree = given.program, self.k, self.scene.tree
        placed = given.placed or add_body_poses(program, tree, given.q)
        (T,) = placed.frames([tree.find(self.frame)])
        J, end = self._jacobian(placed, T, self.columns), program.constant(self.end)
        whole, L, room = program.rows(6), program.rows(3, 6), program.scratch(kernels.PATH_SCRATCH)
        program.add(kernels.compute_path_error, T=T, end=end, room=room, s=whole, L=L)
        s, goal = whole[:k], program.constant(np.ravel(self.s_goal))
        error = program.result(control_law.subtract_goal, "error", k, s=s, s_goal=goal)
        A = self._task_jacobian(program, J, L)
        way = self._straight(given, T, end) if self.task.path is None else self._along(given)
        V = self._twist(given, placed, T, way)
        qd = add_inverse(program, J[:k], V[:k], self.task.inverse)
        qd = self.shaping.stages(given, qd, error, J, A)
        return ControllerOutputs(
            s, error, qd, A, self.busy(given, way), lambda blocks: blocks.get(J)
        )

    def _jacobian(self, placed: FKStages, T: BlockRows, columns: VelocityIndices) -> BlockRows:
        """Return the rows of J (6, n) of the frame at T in world axes, by some velocities."""
        moves = self.scene.tree.moves(self.scene.tree.carried(self.frame), columns)
        return placed.base_jacobian(T, moves)

    def _task_jacobian(self, program: Program, J: BlockRows, L: BlockRows) -> BlockRows:
        """Return the rows of how the joints move s (k, n), with L of the turn."""
        if self.k == 3:
            return J[:3]
        A = program.rows(*J.shape)
        program.add(control_law.copy_rows, rows=J[:3].flat, to=A[:3].flat)
        program.add(control_law.compute_task_jacobian, L=L, J=J, A=A[3:])
        return A

    def _twist(
        self, given: ControllerInputs, placed: FKStages, T: BlockRows, way: ReferenceRows
    ) -> BlockRows:
        """Return the rows of the twist that the joints are to give the frame, in world axes.

        It is the one that takes the frame on, without what prescribed motions give it anyway.
        """
        program, scene = given.program, self.scene
        V = program.result(
            kernels.compute_path_twist,
            "V",
            6,
            T=T,
            here=way.here.reshape(2, 3, 4),
            gain=self.gain_row(given),
            duration=given.dt,
            room=program.scratch(kernels.PATH_SCRATCH),
            wanted=program.rows(3, 4),
        )
        if not scene.motions:
            return V
        prescribed = np.flatnonzero(scene.prescribed)
        J, rates = (
            self._jacobian(placed, T, prescribed),
            add_prescribed_velocities(given, scene, prescribed),
        )
        drift = program.result(control_law.multiply_vector, "out", 6, A=J, x=rates)
        return program.result(control_law.subtract_goal, "error", 6, s=V, s_goal=drift)

    def _along(self, given: ControllerInputs) -> ReferenceRows:
        """Add the stages of a path that is the same for all runs."""

        def at(t: Any) -> Array:
            T = as_floats(self.task.path.at(t), "path.at", (4, 4))
            return T[..., :3, :].reshape(*T.shape[:-2], 12)

        return add_trajectory(given, self.task.path, 12, at)

    def _straight(self, given: ControllerInputs, T: BlockRows, end: BlockRows) -> ReferenceRows:
        """Add the stages of the path of each run, from where its frame at T started."""
        assert self.way_pace is not None
        program, goal, room = given.program, end, given.program.scratch(kernels.PATH_SCRATCH)
        start = program.result(axis_trajectory.store_start, "to", 12, rows=list(T.flat)).reshape(
            3, 4
        )
        if self.k == 3:  # as it is turned at the start
            turned = [(end if i % 4 == 3 else start).flat[i] for i in range(12)]
            goal = program.result(axis_trajectory.store_start, "to", 12, rows=turned).reshape(3, 4)
        way = program.result(
            kernels.plan_straight_motion, "way", 8, start=start, goal=goal, room=room
        )
        pace = self.way_pace
        limits = None if pace.duration is not None else np.reshape(pace.limits, (2, 2))
        times = add_timing(program, way[6:], pace.duration, limits)
        ends = {"start": start, "way": way, "goal": goal, "room": room}
        here = program.result(
            kernels.sample_straight_motion, "here", 2, 3, 4, dt=given.dt, **times, **ends
        )
        return ReferenceRows(here, times["seconds"])


def estimate_generic_rank(scene: Scene, frame: str, columns: VelocityIndices, k: int) -> int:
    """Return the rank of J (k, n) away from singularities.

    It is the largest at home and where every joint has moved a little.
    """
    places = [
        np.concatenate([np.empty(0), *(_move_from_home(robot, far) for robot in scene.robots)])
        for far in (0.0, 0.1, 0.3)
    ]
    tree = scene.tree
    J = tree.jacobian(tree.bodies(np.array(places).T.copy()), frame)
    return int(compute_rank(np.ascontiguousarray(J[:k][:, columns])).max())


def _move_from_home(robot: Any, far: float) -> Array:
    """Return coordinates (nq,) of a robot whose velocities were held for a while from home."""
    rates = far * (1.0 + 0.1 * np.arange(robot.nv))
    moved: Array = robot.integrate(robot.home, rates, 1.0)
    return moved
