"""The commands of a played robot: checks, limits, and braking when commands are missing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.servo.shaping.command_shaper import find_coordinates
from robsim.world.scene import Scene

TINY = 1e-12  # rad/s or m/s: velocities below it are zero
OVERLAP = 0.5  # seconds: publishers of commands within it are active at once, without a timeout


class CommandGate:
    """The commands that reach the joints of a played robot.

    A robot without a new command for `timeout` brakes, as does a robot with commands of several
    publishers. A command beyond the speeds of the joints is scaled, and joints stop at their
    limits. Torques have neither of these limits.

    Parameters
    ----------
    scene : Scene
        Scene of the robot.
    columns : ndarray of int
        Indices of the commanded velocities.
    dt : float
        Control period in seconds.
    timeout : float
        Seconds after the last command until the robot brakes; infinite: it keeps the last command.
    acceleration : ndarray of shape (n,), optional
        Largest change of each velocity in braking, in rad/s^2 or m/s^2. Default: no bound.
    torques : bool, default False
        Whether the commands are torques.

    Attributes
    ----------
    reason : str
        Reason why the robot does not follow its commands, or "".

    Examples
    --------
    >>> from robsim import Scene, robots
    >>> gate = CommandGate(Scene([robots.planar_2r()]), np.arange(2), 0.1, timeout=0.5)
    >>> gate.take(np.array([0.2, 0.0]), 3.0)
    >>> gate.next_command(np.zeros(2), 3.2), gate.next_command(np.zeros(2), 4.0), gate.reason
    (array([0.2, 0. ]), array([0., 0.]), 'no command for 0.5 s: the robot brakes')
    """

    def __init__(
        self,
        scene: Scene,
        columns: NDArray[np.int64],
        dt: float,
        timeout: float,
        acceleration: Array | None = None,
        torques: bool = False,
    ) -> None:
        self._names = [scene.velocity_names[i] for i in columns]
        self._coordinates, self._limits = find_coordinates(scene, columns)
        self._speeds = list_joint_speeds(scene)[columns]
        self._torques = torques
        self._dt, self._timeout = dt, timeout
        unbounded = torques or acceleration is None
        self._step = math.inf if unbounded else np.asarray(acceleration) * dt
        self._overlap = timeout if math.isfinite(timeout) else OVERLAP
        self._senders: dict[bytes, float] = {}  # time of the last command of each publisher
        self._wish = self._last = np.zeros(columns.size)
        self._time = -math.inf  # of the last command
        self._refused = self.reason = ""

    def take(self, command: Array, now: float, sender: bytes = b"") -> None:
        """Store a command (n,) of a publisher that arrived at a time in seconds."""
        self._wish, self._time, self._refused = command, now, ""
        self._senders[sender] = now

    def refuse(self, reason: str) -> None:
        """Store why a message was no command; the last command stays valid until its timeout."""
        self._refused = reason

    def stop(self) -> None:
        """Forget the last command, as after a reset of the robot, which is then at rest."""
        self._wish = self._last = np.zeros(len(self._names))
        self._time, self._refused, self._senders = -math.inf, "", {}

    def next_command(self, q: Array, now: float) -> Array:
        """Return the command (n,) of the period that begins, at coordinates q (nq,)."""
        since = now - self._overlap
        self._senders = {each: t for each, t in self._senders.items() if t >= since}
        if len(self._senders) > 1:
            several = f"commands of {len(self._senders)} publishers"
            self.reason, command = f"{several}: the robot brakes until one is left", self._brake()
        elif now - self._time > self._timeout:
            self.reason, command = self._describe_silence(), self._brake()
        else:
            self.reason, command = self._refused, self._wish
        if not self._torques:
            command = self._keep_within_limits(self._scale_to_speeds(command), q)
        self._last = command
        return command

    def _describe_silence(self) -> str:
        """Return the reason of a robot without new commands."""
        if self._refused:
            return f"{self._refused}: the robot brakes"
        if self._time == -math.inf:
            return "waits for the first command"
        return f"no command for {self._timeout:g} s: the robot brakes"

    def _brake(self) -> Array:
        """Return slower velocities, in the direction of the last ones."""
        rest = float((np.abs(self._last) / self._step).max(initial=0.0))  # periods until rest
        return self._last * (1.0 - 1.0 / rest) if rest > 1.0 else np.zeros_like(self._last)

    def _scale_to_speeds(self, command: Array) -> Array:
        """Return the command in its direction, no faster than the speeds of the joints."""
        shares = np.abs(command) / self._speeds
        i = int(shares.argmax()) if shares.size else 0
        if not shares.size or shares[i] <= 1.0 + TINY:
            return command
        if not self.reason:
            self.reason = f"the command is scaled to the speed of joint {self._names[i]}"
        return np.asarray(command / shares[i])

    def _keep_within_limits(self, command: Array, q: Array) -> Array:
        """Return the command without motions of joints beyond their limits."""
        alone = self._coordinates >= 0
        at = np.where(alone, q[self._coordinates], 0.0)
        low, high = ((self._limits[:, i] - at) / self._dt for i in (0, 1))
        kept = np.clip(command, np.minimum(low, 0.0), np.maximum(high, 0.0))
        stopped = np.flatnonzero(np.abs(kept - command) > TINY)
        if stopped.size and not self.reason:
            names = ", ".join(self._names[i] for i in stopped)
            self.reason = f"a joint stops at its limit: {names}"
        return kept


def list_joint_speeds(scene: Scene) -> Array:
    """Return the largest speed (nv,) of each velocity by its joint, infinite without a limit.

    >>> from robsim import Robot, Scene, joints
    >>> slow = joints.Joint("revolute", speed=2.0)
    >>> arm = Robot("arm", [joints.Link("base"), joints.Link("tip", "base", slow)])
    >>> list_joint_speeds(Scene([arm])).tolist()
    [2.0]
    """
    speeds: list[float] = []
    for joint in (link.joint for robot in scene.robots for link in robot.links):
        limit = math.inf if joint.speed is None else joint.speed
        speeds += [limit] * len(joint.parts.velocities)
    return np.array(speeds)
