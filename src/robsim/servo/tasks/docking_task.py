"""Docking of a unicycle, which cannot move sideways, at a pose in front of its target."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Number, register
from robsim.features.pose_error import Translation
from robsim.geometry.pose import Pose
from robsim.kernels.control import docking_law as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.servo_controller import ServoController
from robsim.servo.tasks.task_fields import TaskGain, WeightingFields


@register("task", "docking")
@dataclass(frozen=True, eq=False)
class Docking(WeightingFields):
    """Drive a unicycle to the pose from which its camera saw the goal, by the law of Aicardi.

    Distance rho to the goal, bearing alpha of the goal from the heading, and bearing theta of the
    way to the goal, in axes of the goal, follow from the estimated pose of the target:
    v = gain cos(alpha) rho, omega = turn alpha + gain cos(alpha) sin(alpha)/alpha (alpha + h theta)
    (Aicardi, Casalino, Bicchi and Balestrino 1995). No smooth law of the pose alone does it
    (Brockett 1983); this one is not continuous at the goal.

    >>> Docking(turn=2.0).turn
    2.0
    """

    _: KW_ONLY
    gain: TaskGain = 1.0
    turn: Annotated[float, PER_SECOND, "TaskGain of the turn towards the goal."] = 3.0
    h: Annotated[float, Number(above=0), "Weight of the angle theta in the turn."] = 2.0

    @property
    def features(self) -> Any:
        """The translation of the camera in axes of the goal, and its rotation."""
        return [Translation("goal"), "theta_u"]

    def warn_of_wheels(self, controller: ServoController) -> None:
        """Warn of nothing: this law is not smooth, and so can reach the pose."""

    def bound_law(self, regulated: BoundFeatures) -> DockingLaw:
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
class DockingLaw(CompiledLaw):
    """The law of `Docking`, for a camera at T_b_c on the unicycle."""

    T_b_c: Pose
    turn: float
    h: float

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stage of where the unicycle is; return what adds that of the command."""
        numbers = of.program.constant([self.turn, self.h])
        given = {"place": self._planar(of.program, of.error), "numbers": numbers}
        return lambda gain: of.program.result(kernels.dock_unicycle, "qd", 2, rate=gain, **given)

    def _planar(self, program: Program, error: BlockRows) -> BlockRows:
        """Add the stage of `planar`, and return its rows (3,)."""
        T_b_c, back = (program.constant(T.matrix[:3]) for T in (self.T_b_c, self.T_b_c.inv()))
        given = {"error": error, "T_b_c": T_b_c, "T_c_b": back, "room": program.rows(30)}
        return program.result(kernels.compute_planar_pose, "x", 3, **given)

    def planar(self, error: Array) -> Array:
        """Return x, y and heading (3, B) of the unicycle in goal axes, from (c*t_c, theta u)."""
        (place,) = evaluated(lambda *rows: [self._planar(*rows)], [error])
        return place
