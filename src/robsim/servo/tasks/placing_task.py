"""The scheme of section 6.2 of the chapter: two cameras watch an arm place a cube."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, Literal, get_args

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Word, register
from robsim.kernels.control import triangle_alignment as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget
from robsim.servo.feature_block import FeatureBlock, IndexList
from robsim.servo.frame_rows import add_body_poses
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, add_joint_velocities
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import PseudoInverse
from robsim.servo.laws.law import UnitOfLength
from robsim.servo.shaping.command_fields import RedundancyFields, VelocityIndices
from robsim.servo.tasks.task import ServoTask
from robsim.servo.tasks.task_checks import is_collinear

PlacingVariant = Literal["corrected", "printed", "completed"]


@register("task", "placing")
@dataclass(frozen=True, eq=False)
class Placing(RedundancyFields, ServoTask):
    """Carry three marks a, b, c, triangulated by two cameras that stand still, to their goal.

    With the unit vectors P_ab, P_ac now (1) and at the goal (2), the chapter's section 6.2 turns
    by Omega = rotation (P_ab1 x P_ac1) x (P_ab2 x P_ac2) and moves by T = translation t_a and a
    term in Omega x p_a; T is the velocity at the origin of the world, v = T + Omega x p at a point
    p, and the frame that holds the target gets it by qdot = J^+ (v, Omega) (eq. 19).

    variant "corrected": T = translation t_a - Omega x p_a, mark a goes straight
            "printed":   plus, as in the chapter; it arrives on a detour
            "completed": corrected, and Omega = rotation/2 times the sum of the cross products of
                         three corresponding edges, sin(theta) times the axis; the chapter's Omega
                         aligns two normals only and never turns about them

    >>> Placing(camera=["left", "right"], variant="printed").variant
    'printed'
    """

    _: KW_ONLY
    variant: Annotated[
        PlacingVariant, Word(get_args(PlacingVariant), "variant"), "PlacingVariant of the law."
    ] = "corrected"
    marks: Annotated[
        tuple[int, int, int],
        IndexList(least=3, most=3),
        "Numbers of the marks a, b and c, which are not on one line.",
    ] = (0, 1, 2)
    rotation: Annotated[float, PER_SECOND, "Gain k1 of the rotation."] = 1.0
    translation: Annotated[float, PER_SECOND, "Gain k2 of the translation."] = 1.0
    length: UnitOfLength = 1.0

    @property
    def features(self) -> Any:
        """The triangulated marks."""
        return [FeatureBlock("stereo_points", marks=self.marks)]

    @property
    def gain(self) -> float:
        """The slower of both rates."""
        return min(self.rotation, self.translation)

    def bound_law(self, regulated: BoundFeatures) -> PlacingLaw:
        """Return the law for the frame that holds the target; InputError if a camera moves."""
        for points in (regulated.sights[0].target.marks[list(self.marks)], regulated.s_goal):
            if is_collinear(points.reshape(3, 3)):
                raise InputError(
                    "the placing law needs three marks that are not on one line, now and at the "
                    f"goal, got {points.reshape(3, 3).tolist()}"
                )
        for sight in regulated.sights:
            carried = sight.scene.tree.carries(sight.eye.name)[regulated.columns]
            if carried.any():
                raise InputError(
                    f"the placing law is for cameras that stand still, and '{sight.eye.name}' "
                    "moves with the joints"
                )
        return PlacingLaw(regulated.sights[0], regulated.columns, regulated.s_goal, self)


@dataclass(frozen=True, eq=False)
class PlacingLaw(CompiledLaw):
    """The law of `Placing`, for one camera and the joints that move its target."""

    sight: CameraTarget
    columns: VelocityIndices
    s_goal: Array  # (9, 1) a, b, c in camera axes
    task: Placing

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of the command, which does not depend on the gain of the task."""
        assert of.s is not None and of.q is not None
        program, tree, held_by = of.program, self.sight.scene.tree, self.sight.target.on
        placed = add_body_poses(program, tree, of.q)
        T_w_c, T = placed.frames([tree.find(self.sight.eye.name), tree.find(held_by)])
        points = of.s.reshape(3, 3), program.constant(np.reshape(self.s_goal, (3, 3)))
        now, goal = (
            program.result(kernels.transform_triangle, "out", 3, 3, T=T_w_c, points=each)
            for each in points
        )
        V = self._twist(program, now, goal)
        program.add(kernels.shift_twist_reference, T=T, twist=V)
        moves = tree.moves(tree.carried(held_by), self.columns)
        J = placed.base_jacobian(T, moves)
        given = of._replace(J=J, inverse=PseudoInverse())
        qd = add_joint_velocities(given, V, program.constant(self.task.length))
        return lambda gain: qd

    def _twist(self, program: Program, now: BlockRows, goal: BlockRows) -> BlockRows:
        """Add the stages of `twist`, and return its rows (6,)."""
        task, marks = self.task, {"now": now, "goal": goal}
        turn, move = program.constant(task.rotation), program.constant(task.translation)
        how = {"gain": turn, "completed": task.variant == "completed"}
        V = program.result(kernels.compute_alignment_rotation, "twist", 6, **marks, **how)
        sign = 1 if task.variant == "printed" else -1
        program.add(kernels.compute_alignment_velocity, **marks, gain=move, sign=sign, twist=V)
        return V

    def twist(self, now: Array, goal: Array) -> tuple[Array, Array]:
        """Return T and Omega (3, B) at the world's origin, from a, b, c (3, 3, B) in its axes."""
        (V,) = evaluated(lambda *rows: [self._twist(*rows)], [now, goal])
        return V[:3], V[3:]
