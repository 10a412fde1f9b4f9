"""The controller that keeps a frame on a path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.kernels.control import axis_trajectory, control_law
from robsim.kernels.control import frame_trajectory as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.robot.robot import Robot
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.frame_rows import add_body_poses, add_prescribed_velocities
from robsim.servo.laws.inverse import RCOND, add_inverse, compute_rank
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.shaping.command_shaper import CommandShaper
from robsim.servo.shaping.free_motions import find_free_motions
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
    """Controller of `FollowPath`."""

    line_pace: Pace | None  # pace of a straight path, from the start of each run to the end
    end: Array  # (3, 4), end of the path
    shaping: CommandShaper

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of one instant to a program; return the rows that they write."""
        program, k, tree = inputs.program, self.k, self.scene.tree
        placed = inputs.placed or add_body_poses(program, tree, inputs.q)
        (T,) = placed.frames([tree.find(self.frame)])
        J, end = self._add_jacobian(placed, T, self.columns), program.constant(self.end)
        whole, L = program.rows(6), program.rows(3, 6)
        program.add(kernels.compute_path_error, T=T, end=end, s=whole, L=L)
        s, goal = whole[:k], program.constant(np.ravel(self.s_goal))
        error = program.result(control_law.subtract_goal, "error", k, s=s, s_goal=goal)
        A = self._add_task_jacobian(program, J, L)
        reference = (
            self._add_straight_path(inputs, T, end)
            if self.task.path is None
            else self._add_path(inputs)
        )
        V = self._add_twist(inputs, placed, T, reference)
        qd = add_inverse(program, J[:k], V[:k], self.task.inverse)
        qd = self.shaping.stages(
            inputs, qd, error, J, A, lambda: find_free_motions(program, A, RCOND)
        )
        return ControllerOutputs(
            s, error, qd, A, self.busy(inputs, reference), lambda blocks: blocks.get(J)
        )

    def _add_jacobian(self, placed: FKStages, T: BlockRows, columns: VelocityIndices) -> BlockRows:
        """Return the rows of J (6, n) of the frame at T in world axes, for some velocities."""
        moves = self.scene.tree.moves(self.scene.tree.flag_moves(self.frame), columns)
        return placed.base_jacobian(T, moves)

    def _add_task_jacobian(self, program: Program, J: BlockRows, L: BlockRows) -> BlockRows:
        """Return the rows of the task Jacobian (k, n) of s, with L of the rotation."""
        if self.k == 3:
            return J[:3]
        A = program.rows(*J.shape)
        program.add(control_law.copy_rows, rows=J[:3].flat, to=A[:3].flat)
        program.add(control_law.compute_task_jacobian, L=L, J=J, A=A[3:])
        return A

    def _add_twist(
        self, inputs: ControllerInputs, placed: FKStages, T: BlockRows, reference: ReferenceRows
    ) -> BlockRows:
        """Return the rows of the twist that the joints must give the frame, in world axes.

        It carries the frame along the path, minus the twist caused by prescribed motions.
        """
        program, scene = inputs.program, self.scene
        V = program.result(
            kernels.compute_path_twist,
            "V",
            6,
            T=T,
            poses=reference.here.reshape(2, 3, 4),
            gain=self.gain_row(inputs),
            duration=inputs.dt,
            scratch=program.scratch(kernels.PATH_SCRATCH),
            target=program.rows(3, 4),
        )
        if not scene.motions:
            return V
        prescribed = np.flatnonzero(scene.prescribed)
        J, rates = (
            self._add_jacobian(placed, T, prescribed),
            add_prescribed_velocities(inputs, scene, prescribed),
        )
        drift = program.result(control_law.multiply_vector, "out", 6, A=J, x=rates)
        return program.result(control_law.subtract_goal, "error", 6, s=V, s_goal=drift)

    def _add_path(self, inputs: ControllerInputs) -> ReferenceRows:
        """Add the stages of a path that all runs share."""

        def at(t: ArrayLike) -> Array:
            T = as_floats(self.task.path.at(t), "path.at", (4, 4))
            return T[..., :3, :].reshape(*T.shape[:-2], 12)

        return add_trajectory(inputs, self.task.path, 12, at)

    def _add_straight_path(
        self, inputs: ControllerInputs, T: BlockRows, end: BlockRows
    ) -> ReferenceRows:
        """Add the stages of the straight path of each run, from the start of its frame at T."""
        assert self.line_pace is not None
        program, goal, room = inputs.program, end, inputs.program.scratch(kernels.PATH_SCRATCH)
        start = program.result(axis_trajectory.store_start, "to", 12, rows=list(T.flat)).reshape(
            3, 4
        )
        if self.k == 3:  # keep the orientation of the start
            position_goal = [(end if i % 4 == 3 else start).flat[i] for i in range(12)]
            goal = program.result(
                axis_trajectory.store_start, "to", 12, rows=position_goal
            ).reshape(3, 4)
        line = program.result(
            kernels.plan_straight_motion, "displacement", 8, start=start, goal=goal, scratch=room
        )
        pace = self.line_pace
        limits = None if pace.duration is not None else np.reshape(pace.limits, (2, 2))
        times = add_timing(program, line[6:], pace.duration, limits)
        ends = {"start": start, "displacement": line, "goal": goal, "scratch": room}
        rows = program.result(
            kernels.sample_straight_motion, "poses", 2, 3, 4, dt=inputs.dt, **times, **ends
        )
        return ReferenceRows(rows, times["seconds"])


def estimate_generic_rank(scene: Scene, frame: str, columns: VelocityIndices, k: int) -> int:
    """Return the rank of J (k, n) away from singularities.

    It is the largest rank at home and at two configurations near home.
    """
    configurations = [
        np.concatenate([np.empty(0), *(_move_from_home(robot, duration) for robot in scene.robots)])
        for duration in (0.0, 0.1, 0.3)
    ]
    tree = scene.tree
    J = tree.jacobian(tree.bodies(np.array(configurations).T.copy()), frame)
    return int(compute_rank(np.ascontiguousarray(J[:k][:, columns])).max())


def _move_from_home(robot: Robot, duration: float) -> Array:
    """Return the coordinates (nq,) of a robot after a motion from home at constant velocities."""
    rates = duration * (1.0 + 0.1 * np.arange(robot.nv))
    q: Array = robot.integrate(robot.home, rates, 1.0)
    return q
