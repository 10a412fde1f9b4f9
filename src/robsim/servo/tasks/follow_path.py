"""Following a path of a frame."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, frozen, numbers, positive, runs_last
from robsim.base.errors import InputError, suggest
from robsim.geometry.pose import Pose, homogeneous, is_pose_like, one_pose
from robsim.kernels import laws, se3
from robsim.kernels.loop import Command
from robsim.kernels.pose_features import theta_u_interaction
from robsim.servo.controller import Decision
from robsim.servo.laws.inverse import Inverse, JacobianTranspose, as_inverse, product, rank
from robsim.servo.measurement import Measurement
from robsim.servo.servo_controller import rcond_of
from robsim.servo.shaping.shaped import Columns, Shaped
from robsim.servo.shaping.shaping import Shaping
from robsim.servo.tasks.follower import Follower, check_trajectory
from robsim.trajectory import Straight
from robsim.trajectory.pace import UNITS, Pace
from robsim.world.scene import Scene

ROWS = {"pose": 6, "position": 3}  # of the twist that is controlled


@dataclass(frozen=True, eq=False)
class FollowPath(Shaped):
    """Drive a frame along a path in the world, by resolved rates; no camera has a part in it.

    to            a pose to go to, straight from wherever a run starts; or a position (3,), with
                  mask "position". It goes as `Straight`, with `duration`, or with `speed` and
                  `acceleration`, and but for a position `turn` and `turn_acceleration`
    path          instead: a Straight, Path, or any object with `duration` in seconds and at(t)
                  (4, 4), whose time is that of the run
    frame         which frame, such as "panda.tool"; None: the tip of the only robot
    mask          "pose", or "position" of the origin alone
    inverse       of J: "pseudo_inverse", "damped", `PseudoInverse(rcond)`, `DampedInverse(damping)`
    gain          per second, at which a distance from the path is made up; at most, and by default,
                  all of it in one period
    tolerance     m and rad: converged when the path is over and the frame this near its end
    joints, secondary, projection, smooth_start, limit
                  what is commanded, and what is done to the command: see `Shaped`

    Resolved motion rate control (Whitney 1969; Siciliano et al. 2009, section 3.7): qdot = J^+ V
    with the twist V = (v, omega) that carries the frame, as it is, to where it should be one period
    later, less what a `Motion` does to it. That is one step of Newton's method in each period, so
    the distance from the path is of the second order in the period. Toward a pose out of reach
    the rates grow, until a joint is at its limit or J loses rank: ask `Robot.ik` before. s is the
    position and the rotation vector from the end of the path, both in world axes.

    >>> FollowPath([0.4, 0.0, 0.3], mask="position", duration=2.0).to
    array([0.4, 0. , 0.3])
    """

    kind: ClassVar[str] = "follow_path"
    to: Any = None
    _: KW_ONLY
    path: Any = None
    frame: str | None = None
    mask: str = "pose"
    duration: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    turn: float | None = None
    turn_acceleration: float | None = None
    inverse: Any = "pseudo_inverse"
    gain: float | None = None
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        put = object.__setattr__
        if not isinstance(self.mask, str) or self.mask not in ROWS:
            raise InputError(f"no mask {self.mask!r:.40}; {suggest(self.mask, ROWS, 'masks')}")
        if self.frame is not None and not isinstance(self.frame, str):
            raise InputError(f"frame: expected a name such as 'arm.tool', got {self.frame!r:.80}")
        if (self.to is None) == (self.path is None):
            raise InputError("give either to=a pose (or a position), or a path")
        if self.to is not None:
            put(self, "to", self._checked_goal())
        self._check_plan()
        put(self, "inverse", as_inverse(self.inverse))
        if isinstance(self.inverse, JacobianTranspose):
            raise InputError("a path needs an inverse of J: the transpose is only a direction")
        if self.gain is not None:
            put(self, "gain", positive(self.gain, "gain (per second)"))
        put(self, "tolerance", positive(self.tolerance, "tolerance"))

    def columns(self, scene: Scene) -> Columns:
        """The velocities that move the frame, and can be commanded."""
        frame = self._frame(scene)
        found = np.flatnonzero((scene.tree.carries(frame) != 0) & ~scene.prescribed)
        if not found.size:
            raise InputError(f"no joint that a task can command moves '{frame}'")
        return self.chosen(scene, frozen(found))

    def bind(self, scene: Scene, columns: Columns | None = None) -> PathFollower:
        """Its controller; InputError for what the scene does not have."""
        columns, frame, k = self.columns(scene), self._frame(scene), ROWS[self.mask]
        end = self._end()
        s_goal = np.concatenate([end[:3, 3], np.zeros(3)])[:k]
        return PathFollower(
            scene,
            frame,
            (),
            columns,
            frozen(s_goal[:, None]),
            ("m", "m", "m", "rad", "rad", "rad")[:k],
            np.full(k, self.tolerance),
            np.empty((0, 2)),
            self.gain or 1.0,
            _usual_rank(scene, frame, columns, k),
            rcond_of(self.inverse),
            self.gain,
            self,
            end,
            self.inverse,
            self.shaping(scene, columns),
        )

    def planned(self, start: Array) -> Any:
        """The path of runs whose frame starts at (B, 3, 4)."""
        if self.path is not None:
            return self.path
        first = homogeneous(runs_last(start, 2))
        if isinstance(self.to, Pose):
            return Straight(first, self.to, **self._limits_given())
        last = first.copy()
        last[:, :3, 3] = self.to
        return Straight(first, last, **self._limits_given())

    def _limits_given(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in UNITS}

    def _frame(self, scene: Scene) -> str:
        """InputError if there is none of that name."""
        if self.frame is not None:
            scene.tree.find(self.frame)
            return self.frame
        tips = [f"{robot.name}.{robot.tip}" for robot in scene.robots]
        if len(tips) != 1:
            raise InputError(f"frame: which one is to move? Tips: {', '.join(tips) or 'none'}")
        return tips[0]

    def _end(self) -> Array:
        """(3, 4) where the path ends."""
        if self.path is not None:
            _ = one_pose(self.path.at(0.0), "path.at")
            return one_pose(self.path.at(self.path.duration), "path.at").matrix[:3]
        if isinstance(self.to, Pose):
            return self.to.matrix[:3]
        return Pose.at(*self.to).matrix[:3]

    def _checked_goal(self) -> Any:
        """A pose, or a position."""
        if is_pose_like(self.to):
            pose = Pose(one_pose(self.to, "to").matrix)  # in the world, whatever names it has
            return pose if self.mask == "pose" else pose.position
        place = numbers(self.to, "to (a pose, or a position)", (3,))
        if place.ndim != 1:
            raise InputError(f"to: expected one position (3,), got {place.shape}")
        if self.mask == "pose":
            raise InputError('to: expected a pose; a position alone is for mask="position"')
        return frozen(place)

    def _check_plan(self) -> None:
        """Either a path, or a duration, or limits of all that is to move."""
        given = {name: value for name, value in self._limits_given().items() if value is not None}
        if self.path is not None:
            if given:
                raise InputError("a path has its own times: leave duration and limits out")
            check_trajectory(self.path, "path")
            return
        pace = Pace(**given)
        for name in given:
            object.__setattr__(self, name, getattr(pace, name))
        turns = self.mask == "pose"
        if pace.duration is None and (pace.speed is None or turns == (pace.turn is None)):
            also = ", turn and turn_acceleration" if turns else " alone"
            raise InputError(f"limits: expected speed, acceleration{also}; got {', '.join(given)}")


@dataclass(frozen=True, eq=False)
class PathFollower(Follower):
    """The controller of `FollowPath`."""

    task: FollowPath
    end: Array  # (3, 4) of the path
    inverse: Inverse
    shaping: Shaping

    def decide(self, measurement: Measurement) -> Decision:
        """To where the frame should be one period later."""
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
        if not self.shaping.idle:
            qd = self.shaping.shaped(measurement, qd, task_jacobian, error, J)
        return Decision(Command(s, error, qd, task_jacobian), J, None)

    def planned(self, start: Array) -> Any:
        """From where the frame of each run started (B, 3, 4)."""
        return self.task.planned(start)

    def _twist(self, measurement: Measurement, T: Array) -> Array:
        """(v, omega) (6, B) in world axes that carry the frame to its next place."""
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
        """(v, omega) (6, B) of the frame by what moves on its own."""
        if not self.scene.motions:
            return 0.0
        rates = self.scene.drift(measurement.time)[:, None, None]
        return product(J, np.repeat(rates, measurement.runs, axis=2))[:, 0]

    def _at(self, path: Any, seconds: float, measurement: Measurement) -> Array:
        """(3, 4, B)."""
        T = numbers(path.at(seconds), "path.at", (4, 4))
        return runs_last(np.broadcast_to(T[..., :3, :], (measurement.runs, 3, 4)), 2)

    def _task_jacobian(self, J: Array, away: Array) -> Array:
        """(k, n, B) how the joints move s; d(theta u)/dt = L_w(-theta u) omega in fixed axes."""
        if self.k == 3:
            return np.ascontiguousarray(J[:3])
        L = np.empty((3, 6, away.shape[1]))
        theta_u_interaction(-away, L)
        turns = product(np.ascontiguousarray(L[:, 3:]), np.ascontiguousarray(J[3:]))
        return np.concatenate([J[:3], turns])

    def _solved(self, J: Array, V: Array) -> Array:
        """J^+ V (n, B)."""
        qd = np.empty(J.shape[1:])
        laws.joint(J, np.ascontiguousarray(V), -1.0, *self.inverse.numbers, qd)
        return qd


def turn_between(A: Array, B: Array) -> Array:
    """Rotation vector (3, runs) of R_b R_a', in the base axes of both (3, 4, runs)."""
    A, back, turned = np.ascontiguousarray(A), np.empty(A.shape), np.empty(A.shape)
    se3.inverse(A, back)
    se3.compose(B, back, turned)
    quaternion, turn = np.empty((4, A.shape[-1])), np.empty((3, A.shape[-1]))
    se3.rotation_to_quaternion(turned, quaternion)
    se3.rotation_vector(quaternion, turn)
    return turn


def _usual_rank(scene: Scene, frame: str, columns: Columns, k: int) -> int:
    """Of J (k, n) where nothing is singular: at home, and where every joint has moved a little."""
    places = [
        np.concatenate([np.empty(0), *(_moved(robot, far) for robot in scene.robots)])
        for far in (0.0, 0.1, 0.3)
    ]
    tree = scene.tree
    J = tree.jacobian(tree.bodies(np.array(places).T.copy()), frame)
    return int(rank(np.ascontiguousarray(J[:k][:, columns])).max())


def _moved(robot: Any, far: float) -> Array:
    """Coordinates (nq,) of a robot whose every velocity was held for a while from its home."""
    rates = far * (1.0 + 0.1 * np.arange(robot.nv))
    moved: Array = robot.integrate(robot.home, rates, 1.0)
    return moved
