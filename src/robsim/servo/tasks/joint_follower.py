"""The controller that follows a trajectory of joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, numbers
from robsim.base.errors import InputError
from robsim.robot.joint import LIMIT_SLACK
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.measurement import Measurement, recall
from robsim.servo.tasks.follower import Follower
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class JointFollower(Follower):
    """The controller of `FollowJoints`."""

    plan: Callable[[Array, Array], Any]  # the trajectory from starts to goals (B, n)
    relative: bool  # whether the goal is counted from the start
    goal: Array  # (n,) in the order of the axes of the trajectory; with `by` from the start
    coordinates: NDArray[np.int64]  # of these axes
    order: NDArray[np.int64]  # of the axes for the commanded velocities, which are sorted

    def decide(self, measurement: Measurement) -> Decision:
        """Return the command that stays on the trajectory, or goes back to it."""
        q = np.ascontiguousarray(measurement.q[self.coordinates])
        r = self.trajectory(measurement, q)
        here, ahead = (
            self._at(r, t, measurement)
            for t in (measurement.time, (measurement.step + 1) * measurement.dt)
        )
        qd = (ahead - here) / measurement.dt + self.rate(measurement.dt) * (here - q)
        s = (q - recall(measurement.memory, "start") if self.relative else q)[self.order]
        qd = np.ascontiguousarray(qd[self.order])
        task_jacobian = np.zeros((self.k, self.k, measurement.runs))
        task_jacobian[range(self.k), range(self.k)] = 1.0
        return Decision(Command(s, s - self.s_goal, qd, task_jacobian), self._jacobian(measurement))

    def planned(self, start: Array) -> Any:
        """Return the trajectory of runs from where they started (B, n)."""
        return self.plan(start, self.goal_from(start))

    def goal_from(self, start: Array) -> Array:
        """Return where runs go (B, n) or (n,) whose joints started at (B, n)."""
        return start + self.goal if self.relative else self.goal

    def check_start(self, q0: Array) -> None:
        """Raise InputError if the joint limits let no run go as far as it should."""
        if self.relative:
            goals = self.goal_from(q0[:, self.coordinates])
            check_limits(self.scene, self.coordinates, goals)

    def _at(self, trajectory: Any, seconds: float, measurement: Measurement) -> Array:
        """Return the goal (n, B) in the order of the axes."""
        n = self.k
        there = numbers(trajectory.at(seconds), "trajectory.at", (n,))
        return np.ascontiguousarray(np.broadcast_to(there, (measurement.runs, n)).T)

    def _jacobian(self, measurement: Measurement) -> Array:
        """Return the Jacobian (6, n, B) of the tip."""
        tree = self.scene.tree
        return np.ascontiguousarray(
            tree.jacobian(tree.bodies(measurement.q), self.frame)[:, self.columns]
        )


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
