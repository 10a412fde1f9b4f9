"""The controller that follows a trajectory of joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.features.feature_rows import select_rows
from robsim.kernels.control import axis_trajectory, control_law
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.joint import LIMIT_SLACK
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.tasks.trajectory_follower import (
    ReferenceRows,
    TrajectoryFollower,
    add_timing,
    add_trajectory,
)
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class JointFollower(TrajectoryFollower):
    """Controller of `FollowJoints`."""

    goal: Array  # (n,) in the order of the axes of the trajectory; with `by` relative to the start
    coordinates: NDArray[np.int64]  # coordinate index of each axis
    order: NDArray[np.int64]  # axis of each commanded velocity; velocities are sorted

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of one instant to a program; return the rows that they write."""
        program, n = inputs.program, self.k
        q = [inputs.q[i] for i in self.coordinates]
        start = program.result(axis_trajectory.store_start, "to", n, rows=q)
        reference = self._add_reference(inputs, start)
        qd = program.result(
            axis_trajectory.track_axes,
            "qd",
            n,
            positions=reference.here,
            gain=self.gain_row(inputs),
            duration=inputs.dt,
            axes=[(axis, q[axis]) for axis in self.order.tolist()],
        )
        rows = (
            *self._add_error(inputs, start),
            qd,
            program.constant(np.eye(n)),
            self.busy(inputs, reference),
        )
        return ControllerOutputs(*rows, lambda blocks: self._tip_jacobian(blocks.get(inputs.q)))

    def _add_error(self, inputs: ControllerInputs, start: BlockRows) -> tuple[BlockRows, BlockRows]:
        """Add the stages of s and of the error; return their rows."""
        program, goal = inputs.program, inputs.program.constant(self.s_goal.ravel())
        s = select_rows(program, inputs.q, self.coordinates[self.order])
        if self.task.relative:
            since = select_rows(program, start, self.order)
            s = program.result(control_law.subtract_goal, "error", self.k, s=s, s_goal=since)
        return s, program.result(control_law.subtract_goal, "error", self.k, s=s, s_goal=goal)

    def _add_reference(self, inputs: ControllerInputs, start: BlockRows) -> ReferenceRows:
        """Add the stages of the trajectory of each run, from the start of its joints."""
        n, program = self.k, inputs.program
        if self.task.trajectory is not None:
            at = self.task.trajectory.at
            return add_trajectory(
                inputs, self.task.trajectory, n, lambda t: as_floats(at(t), "trajectory.at", (n,))
            )
        goal = program.constant(np.ravel(self.goal))
        if self.task.relative:
            goal = program.result(control_law.add_vectors, "out", n, x=start, y=goal)
        distances = program.result(control_law.subtract_goal, "error", n, s=goal, s_goal=start)
        limits = None if self.task.limits is None else np.stack(self.task.limits.of(n))
        times = add_timing(program, distances, self.task.duration, limits)
        arguments = {"start": start, "displacements": distances, "goal": goal}
        rows = program.result(
            axis_trajectory.sample_axis_trajectory,
            "positions",
            2,
            n,
            dt=inputs.dt,
            **times,
            **arguments,
        )
        return ReferenceRows(rows, times["seconds"])

    def goal_from(self, start: Array) -> Array:
        """Return the final coordinates (B, n) or (n,) of runs with the start coordinates (B, n)."""
        return start + self.goal if self.task.relative else self.goal

    def check_start(self, q0: Array) -> None:
        """Raise InputError if the joint limits allow the motion in no run."""
        if self.task.relative:
            goals = self.goal_from(q0[:, self.coordinates])
            check_joint_goals(self.scene, self.coordinates, goals)

    def _tip_jacobian(self, q: Array) -> Array:
        """Return the Jacobian (6, n, B) of the tip."""
        tree = self.scene.tree
        J = tree.jacobian(tree.bodies(q), self.frame)
        return np.ascontiguousarray(J[:, self.columns])


def check_joint_goals(scene: Scene, coordinates: NDArray[np.int64], goals: Array) -> None:
    """Raise InputError if no goal (B, n) is within the limits of a joint."""
    for i, values in zip(coordinates, goals.T, strict=True):
        low, high = scene.limits[i]
        if not ((low - LIMIT_SLACK <= values) & (values <= high + LIMIT_SLACK)).any():
            name, unit = scene.coordinate_names[i], scene.coordinate_units[i]
            raise InputError(
                f"joint '{name}' is to go to {values[0]:.6g} {unit}, outside its limits "
                f"[{low:.6g}, {high:.6g}] {unit}"
            )
