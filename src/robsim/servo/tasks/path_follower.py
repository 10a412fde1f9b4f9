"""The controller that keeps a frame on a path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array, numbers, runs_last
from robsim.kernels import laws, se3
from robsim.kernels.pose_features import theta_u_interaction
from robsim.kernels.program import Blocks
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.deciding import Deciding
from robsim.servo.given import Commanded, Given
from robsim.servo.laws.inverse import Inverse, product, rank
from robsim.servo.measurement import Measurement
from robsim.servo.shaping.shaped import Columns
from robsim.servo.shaping.shaping import Shapeable, Shaping
from robsim.servo.tasks.follower import Follower
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class PathFollower(Follower):
    """The controller of `FollowPath`."""

    plan: Callable[[Array], Any]  # the path of runs whose frame starts at (B, 3, 4)
    end: Array  # (3, 4) of the path
    inverse: Inverse
    shaping: Shaping

    def stages(self, given: Given) -> Commanded:
        """Add the stages of an instant to a program, and return the rows that they write."""
        deciding = Deciding(self, given)
        given.program.call(deciding)
        rows, n = deciding.rows, self.columns.size
        matrices = deciding.J, rows.task_jacobian
        qd = self.shaping.stages(given, Shapeable(self.k, n, rows.error, *matrices, rows.qd))

        def decide(blocks: Blocks) -> Decision:
            decision = deciding.last(blocks)
            command = decision.command._replace(qd=blocks.get(qd, n))
            return decision._replace(command=command)

        return replace(rows, qd=qd, decide=decide)

    def decide(self, measurement: Measurement) -> Decision:
        """Return the command that takes the frame to where it should be one period later."""
        tree = self.scene.tree
        M = tree.bodies(measurement.q)
        T = tree.frame(M, self.frame)
        every = tree.jacobian(M, self.frame)
        J = np.ascontiguousarray(every[:, self.columns])
        away = turn_between(np.broadcast_to(self.end[..., None], T.shape), T)
        s = np.concatenate([T[:, 3], away])[: self.k]
        error, task_jacobian = s - self.s_goal, self._task_jacobian(J, away)
        V = self._twist(measurement, T) - self._drift(measurement, every)
        qd = self._solved(np.ascontiguousarray(J[: self.k]), V[: self.k])
        return Decision(Command(s, error, qd, task_jacobian), J)

    def planned(self, start: Array) -> Any:
        """Return the path from where the frame of each run started (B, 3, 4)."""
        return self.plan(start)

    def _twist(self, measurement: Measurement, T: Array) -> Array:
        """Return the twist (v, omega) (6, B) in world axes that takes the frame on."""
        path = self.trajectory(measurement, T)
        here, ahead = (
            self._at(path, t, measurement)
            for t in (measurement.time, (measurement.step + 1) * measurement.dt)
        )
        left = 1.0 - self.rate(measurement.dt) * measurement.dt  # of what is missed, a period later
        wanted = ahead.copy()
        if left > 0.0:
            twist, back = np.zeros((6, measurement.runs)), np.empty(T.shape)
            twist[3:] = left * turn_between(here, T)
            se3.exp(twist, back)
            se3.compose(back, ahead, wanted)
            wanted[:, 3] = ahead[:, 3] + left * (T[:, 3] - here[:, 3])
        V = np.concatenate([wanted[:, 3] - T[:, 3], turn_between(T, wanted)])
        return V / measurement.dt

    def _drift(self, measurement: Measurement, J: Array) -> Any:
        """Return the twist (v, omega) (6, B) of the frame that prescribed motions cause."""
        if not self.scene.motions:
            return 0.0
        rates = self.scene.drift(measurement.time)[:, None, None]
        return product(J, np.repeat(rates, measurement.runs, axis=2))[:, 0]

    def _at(self, path: Any, seconds: float, measurement: Measurement) -> Array:
        """Return the pose (3, 4, B) of a path at a time."""
        T = numbers(path.at(seconds), "path.at", (4, 4))
        return runs_last(np.broadcast_to(T[..., :3, :], (measurement.runs, 3, 4)), 2)

    def _task_jacobian(self, J: Array, away: Array) -> Array:
        """Return how the joints move s (k, n, B).

        d(theta u)/dt = L_w(-theta u) omega in fixed axes.
        """
        if self.k == 3:
            return np.ascontiguousarray(J[:3])
        L = np.empty((3, 6, away.shape[1]))
        theta_u_interaction(-away, L)
        turns = product(np.ascontiguousarray(L[:, 3:]), np.ascontiguousarray(J[3:]))
        return np.concatenate([J[:3], turns])

    def _solved(self, J: Array, V: Array) -> Array:
        """Return the velocities J^+ V (n, B)."""
        qd = np.empty(J.shape[1:])
        laws.joint(J, np.ascontiguousarray(V), -1.0, *self.inverse.numbers, qd)
        return qd


def turn_between(A: Array, B: Array) -> Array:
    """Return the rotation vector (3, runs) of R_b R_a', in the base axes of both (3, 4, runs)."""
    A, back, turned = np.ascontiguousarray(A), np.empty(A.shape), np.empty(A.shape)
    se3.inverse(A, back)
    se3.compose(B, back, turned)
    quaternion, turn = np.empty((4, A.shape[-1])), np.empty((3, A.shape[-1]))
    se3.rotation_to_quaternion(turned, quaternion)
    se3.rotation_vector(quaternion, turn)
    return turn


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
