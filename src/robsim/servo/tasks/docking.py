"""Docking of a unicycle, which cannot move sideways, at a pose in front of its target."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.base.errors import InputError
from robsim.declare import Number, register
from robsim.features import Translation
from robsim.geometry.pose import Pose
from robsim.kernels import se3
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.law import ControlState
from robsim.servo.regulated import Regulated
from robsim.servo.servo_controller import Servo
from robsim.servo.tasks.task import ServoTask

HERE = 1e-9  # metres; nearer, the bearing of the goal is rounding: the unicycle turns on the spot


@register("task", "docking")
@dataclass(frozen=True, eq=False)
class Docking(ServoTask):
    """Drive a unicycle to the pose from which its camera saw the goal, by the law of Aicardi.

    Distance rho to the goal, bearing alpha of the goal from the heading, and bearing theta of the
    way to the goal, in axes of the goal, follow from the estimated pose of the target:
    v = gain cos(alpha) rho, omega = turn alpha + gain cos(alpha) sin(alpha)/alpha (alpha + h theta)
    (Aicardi, Casalino, Bicchi and Balestrino 1995). No smooth law of the pose alone does it
    (Brockett 1983); this one is not continuous at the goal.

    >>> Docking(turn=2.0).turn
    2.0
    """

    own_law: ClassVar[bool] = True
    features: Any = field(default=None, init=False, repr=False)
    law: Any = field(default="joint", init=False, repr=False)
    _: KW_ONLY
    turn: Annotated[float, PER_SECOND, "Gain of the turn towards the goal."] = 3.0
    h: Annotated[float, Number(above=0), "Weight of the angle theta in the turn."] = 2.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "features", [Translation("goal"), "theta_u"])
        super().__post_init__()

    def warn_of_wheels(self, controller: Servo) -> None:
        """Warn of nothing: this law is not smooth, and so can reach the pose."""

    def bound_law(self, regulated: Regulated) -> DockingLaw:
        """Return the law; InputError unless one unicycle carries the camera."""
        eye, scene = regulated.sights[0].eye, regulated.sights[0].scene
        body, T_b_c = scene.tree.find(eye.name)
        moved = scene.tree.owners[regulated.columns]
        kind = scene.tree.models[body]
        drives = kind.wheeled and kind.needs != "steering"
        if not drives or (moved != body).any() or moved.size != 2:
            raise InputError(
                f"docking is for a camera that rides on a unicycle; '{eye.name}' does not, or "
                "other joints move as well"
            )
        return DockingLaw(Pose(T_b_c), self.turn, self.h)


@dataclass(frozen=True, eq=False)
class DockingLaw:
    """The law of `Docking`, for a camera at T_b_c on the unicycle."""

    T_b_c: Pose
    turn: float
    h: float

    def command(self, state: ControlState) -> Array:
        """Return the velocities (v, omega) (B, 2) of the unicycle."""
        x, y, heading = self.planar(state.error_last)
        rho = np.sqrt(x * x + y * y)
        theta = np.where(rho > HERE, np.arctan2(-y, -x), 0.0)
        alpha = _wrapped(theta - heading)
        gain = state.times_gain(np.ones_like(rho))
        v = gain * np.cos(alpha) * rho
        curl = np.cos(alpha) * np.sinc(alpha / np.pi)
        omega = self.turn * alpha + gain * curl * (alpha + self.h * theta)
        return first_view(np.stack([v, omega]))

    def planar(self, error: Array) -> tuple[Array, Array, Array]:
        """Return position and heading of the unicycle in goal axes, from (c*t_c, theta u)."""
        runs = error.shape[1]
        T_goal_c, T_c, T_goal_b = (np.empty((3, 4, runs)) for _ in range(3))
        twist = np.zeros((6, runs))
        twist[3:] = error[3:]
        se3.exp(twist, T_goal_c)
        T_goal_c[:, 3] = error[:3]
        se3.compose_constant(T_goal_c, self.T_b_c.inv().matrix[:3], T_c)
        hand_eye = np.ascontiguousarray(np.broadcast_to(self.T_b_c.matrix[:3, :, None], T_c.shape))
        se3.compose(hand_eye, T_c, T_goal_b)
        heading = np.arctan2(T_goal_b[1, 0], T_goal_b[0, 0])
        return T_goal_b[0, 3], T_goal_b[1, 3], heading


def _wrapped(angle: Array) -> Array:
    """Return an angle wrapped to [-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
