"""The controller that follows a trajectory of joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, numbers
from robsim.base.errors import InputError
from robsim.kernels.control import commanding, following
from robsim.kernels.machine.program import Blocks
from robsim.kernels.machine.rows import Rows
from robsim.robot.joint import LIMIT_SLACK
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.given import Commanded, Given
from robsim.servo.tasks.followed import Followed, followed
from robsim.servo.tasks.follower import Follower
from robsim.trajectory.limits import Limits
from robsim.trajectory.timing import ALIKE
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class JointFollower(Follower):
    """The controller of `FollowJoints`."""

    trajectory: Any  # the same for all runs; None: from where each of them starts to the goal
    duration: float | None  # of a way to the goal; None: as the limits allow
    limits: Limits | None
    relative: bool  # whether the goal is counted from the start
    goal: Array  # (n,) in the order of the axes of the trajectory; with `by` from the start
    coordinates: NDArray[np.int64]  # of these axes
    order: NDArray[np.int64]  # of the axes for the commanded velocities, which are sorted

    def stages(self, given: Given) -> Commanded:
        """Add the stages of an instant to a program, and return the rows that they write."""
        program, n = given.program, self.k
        q, start = [given.q[i] for i in self.coordinates], program.rows(n)
        program.add(following.remembered, to=start, rows=q)
        way, (s, error), qd = self._way(given, start), self._missed(given, start), program.rows(n)
        program.add(
            following.towards,
            here=way.here,
            gain=self.gain_row(given),
            duration=given.dt,
            qd=qd,
            axes=[(axis, q[axis]) for axis in self.order.tolist()],
        )
        task_jacobian = program.constant(np.eye(n))

        def decide(blocks: Blocks) -> Decision:
            command = Command(*map(blocks.get, (s, error, qd, task_jacobian)))
            return Decision(command, self._jacobian(blocks.get(given.q)))

        rows = s, error, qd, task_jacobian, self.busy(given, way)
        return Commanded(*rows, decide, lambda qd: None)

    def _missed(self, given: Given, start: Rows) -> tuple[Rows, Rows]:
        """Add the stages of s and of the error, and return their rows."""
        program, n = given.program, self.k
        s, error = program.rows(n), program.rows(n)
        since = start if self.relative else program.constant(np.zeros(n))
        for i, axis in enumerate(self.order.tolist()):
            q, own = self.coordinates[axis], slice(i, i + 1)
            where = {"s": given.q[q : q + 1], "s_goal": since[axis : axis + 1]}
            program.add(commanding.difference, **where, error=s[own])
        program.add(
            commanding.difference, s=s, s_goal=program.constant(self.s_goal.ravel()), error=error
        )
        return s, error

    def _way(self, given: Given, start: Rows) -> Followed:
        """Add the stages of the trajectory of each run, from where its joints started."""
        n, program = self.k, given.program
        if self.trajectory is not None:
            at = self.trajectory.at
            return followed(
                given, self.trajectory, n, lambda t: numbers(at(t), "trajectory.at", (n,))
            )
        goal, way = program.constant(np.ravel(self.goal)), program.rows(n)
        if self.relative:
            change, goal = goal, program.rows(n)
            program.add(commanding.summed, x=start, y=change, out=goal)
        program.add(commanding.difference, s=goal, s_goal=start, error=way)
        seconds, ramps = self._timing(given, way)
        here = program.rows(2, n)
        program.add(
            following.axes,
            dt=given.dt,
            seconds=seconds,
            ramps=ramps,
            start=start,
            ways=way,
            goal=goal,
            here=here,
        )
        return Followed(here, seconds)

    def _timing(self, given: Given, way: Rows) -> tuple[Rows, Rows]:
        """Return the rows of the duration of a way, and of its ramps."""
        n, program = self.k, given.program
        if self.limits is None:
            return program.constant(self.duration), program.constant(np.full(n, ALIKE))
        seconds, ramps = program.rows(), program.rows(n)
        limits = program.constant(np.stack(self.limits.of(n)))
        program.add(following.paced, ways=way, limits=limits, ramps=ramps, seconds=seconds)
        return seconds, ramps

    def goal_from(self, start: Array) -> Array:
        """Return where runs go (B, n) or (n,) whose joints started at (B, n)."""
        return start + self.goal if self.relative else self.goal

    def check_start(self, q0: Array) -> None:
        """Raise InputError if the joint limits let no run go as far as it should."""
        if self.relative:
            goals = self.goal_from(q0[:, self.coordinates])
            check_limits(self.scene, self.coordinates, goals)

    def _jacobian(self, q: Array) -> Array:
        """Return the Jacobian (6, n, B) of the tip."""
        tree = self.scene.tree
        J = tree.jacobian(tree.bodies(q), self.frame)
        return np.ascontiguousarray(J[:, self.columns])


def check_limits(scene: Scene, coordinates: NDArray[np.int64], goals: Array) -> None:
    """Raise InputError if no goal (B, n) is within the limits of a joint."""
    for i, values in zip(coordinates, goals.T, strict=True):
        low, high = scene.limits[i]
        if not ((low - LIMIT_SLACK <= values) & (values <= high + LIMIT_SLACK)).any():
            name, unit = scene.coordinate_names[i], scene.coordinate_units[i]
            raise InputError(
                f"joint '{name}' is to go to {values[0]:.6g} {unit}, outside its limits "
                f"[{low:.6g}, {high:.6g}] {unit}"
            )
