"""Docking of a unicycle, which cannot move sideways, at a pose in front of its target."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Number, PerRun, register
from robsim.features.pose_error import Translation
from robsim.geometry.pose import Pose
from robsim.kernels.control import docking_law as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_block import Features
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.servo_controller import ServoController
from robsim.servo.tasks.task_fields import Gain, WeightingFields


@register("task", "docking")
@dataclass(frozen=True, eq=False)
class Docking(WeightingFields):
    """Docking of a unicycle: drive to the goal pose in front of a target.

    The estimated pose of the target gives, in polar coordinates about the goal, the distance rho
    to the goal, the bearing alpha of the goal from the heading, and the bearing theta of the line
    to the goal in goal axes. The law

        v = gain cos(alpha) rho
        omega = turn alpha + gain cos(alpha) sin(alpha)/alpha (alpha + h theta)

    drives all three to zero (Aicardi, Casalino, Bicchi and Balestrino 1995). No smooth law of the
    pose alone can do so (Brockett 1983); this law is not continuous at the goal.

    The vehicle drives on a smooth curve and may start backwards. `turn` makes it face the goal
    earlier, and `h` makes it approach along the axis of the goal from farther away. Use `Docking`
    only for one unicycle with a camera; no other joint may move.

    Raises
    ------
    InputError
        By `simulate`, unless one unicycle carries the camera and no other joint is commanded.
    GoalError
        By `simulate`, if a mark of the goal is outside the image.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("unicycle_docking"))
    >>> run = rs.simulate(scenario.scene, rs.Docking(turn=2.0), scenario.start, duration=30)
    >>> rs.Outcome(int(run.outcome)).name
    'CONVERGED'
    """

    _: KW_ONLY
    gain: Annotated[Gain, PerRun(())] = 1.0
    turn: Annotated[float, PER_SECOND, "Gain of the rotation towards the goal."] = 3.0
    h: Annotated[
        float, Number(above=0), "Weight of the angle theta in the rotation, dimensionless."
    ] = 2.0

    @property
    def features(self) -> Features:
        """Translation and rotation of the camera in goal axes."""
        return [Translation("goal"), "theta_u"]

    def warn_of_wheels(self, controller: ServoController) -> None:
        """Issue no warning: the law is not smooth, so it can reach the pose."""

    def bound_law(self, regulated: BoundFeatures) -> DockingLaw:
        """Return the law; raise InputError unless one unicycle carries the camera."""
        eye, scene = regulated.sights[0].eye, regulated.sights[0].scene
        body, T_b_c = scene.tree.find(eye.name)
        owners = scene.tree.owners[regulated.columns]
        kind = scene.tree.models[body]
        drives = kind.wheeled and kind.needs != "steering"
        if not drives or (owners != body).any() or owners.size != 2:
            raise InputError(
                f"docking is for a camera that rides on a unicycle; '{eye.name}' does not, or "
                "other joints move as well"
            )
        return DockingLaw(Pose(T_b_c), self.turn, self.h)


@dataclass(frozen=True, eq=False)
class DockingLaw(CompiledLaw):
    """Law of `Docking`, for a camera at T_b_c on the unicycle."""

    T_b_c: Pose
    turn: float
    h: float

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stage of the pose of the unicycle; return a function that adds the command."""
        numbers = of.program.constant([self.turn, self.h])
        arguments = {"pose": self._add_planar_pose(of.program, of.error), "numbers": numbers}
        return lambda gain: of.program.result(
            kernels.dock_unicycle, "qd", 2, rate=gain, **arguments
        )

    def _add_planar_pose(self, program: Program, error: BlockRows) -> BlockRows:
        """Add the stage of `planar`; return its rows (3,)."""
        T_b_c, back = (program.constant(T.matrix[:3]) for T in (self.T_b_c, self.T_b_c.inv()))
        arguments = {"error": error, "T_b_c": T_b_c, "T_c_b": back, "scratch": program.rows(30)}
        return program.result(kernels.compute_planar_pose, "x", 3, **arguments)

    def planar(self, error: Array) -> Array:
        """Return x, y and heading (3, B) of the unicycle in goal axes, from (c*t_c, theta u)."""
        (pose,) = evaluate_stages(lambda *rows: [self._add_planar_pose(*rows)], [error])
        return pose
