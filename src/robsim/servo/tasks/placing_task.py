"""The scheme of section 6.2 of the chapter: two fixed cameras watch an arm place a cube."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Word, register
from robsim.kernels.control import triangle_alignment as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
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
    """Placing of an object with two fixed cameras that triangulate three of its marks.

    The law computes a twist at the origin of the world (chapter, section 6.2),

        Omega = rotation (P_ab1 x P_ac1) x (P_ab2 x P_ac2)
        T = translation t_a - Omega x p_a

    with the unit vectors P_ab and P_ac from mark a to the marks b and c, now (1) and at the goal
    (2). Mark a is at p_a and has the translation t_a left to its goal. A point p then has the
    velocity v = T + Omega x p. The frame that holds the target gets this twist by eq. 19,
    qdot = J^+ (v, Omega).

    `variant` chooses among three laws:

    - "corrected": the law above; mark a moves on a straight line.
    - "printed": T = translation t_a + Omega x p_a, as the chapter prints it; the object arrives on
      a detour.
    - "completed": as "corrected", with Omega = rotation/2 times the sum of the cross products of
      three corresponding edges, which is sin(theta) times the axis of rotation. The chapter's
      Omega aligns two normals and never turns the object about them.

    `rotation` and `translation` are the rates of the two motions. A large ratio of them turns the
    object before it moves.

    Raises
    ------
    InputError
        By `simulate`, if a camera moves with the joints, or if the marks lie on one line now or at
        the goal.
    GoalError
        By `simulate`, if a mark of the goal is outside an image.

    Examples
    --------
    The sign in the printed law costs half a metre:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("chapter_6_2"))
    >>> for variant in "corrected", "printed":
    ...     task = replace(scenario.task, variant=variant)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(rs.Outcome(int(run.outcome)).name, f"{float(run.path_length):.2f} m")
    CONVERGED 0.34 m
    CONVERGED 0.83 m
    """

    _: KW_ONLY
    variant: Annotated[
        PlacingVariant, Word(get_args(PlacingVariant), "variant"), "Variant of the law."
    ] = "corrected"
    marks: Annotated[
        tuple[int, int, int],
        IndexList(least=3, most=3),
        "Indices of the marks a, b and c, which must not lie on one line.",
    ] = (0, 1, 2)
    rotation: Annotated[float, PER_SECOND, "Gain k1 of the rotation."] = 1.0
    translation: Annotated[float, PER_SECOND, "Gain k2 of the translation."] = 1.0
    length: UnitOfLength = 1.0

    @property
    def features(self) -> list[FeatureBlock]:
        """Triangulated positions of the marks."""
        return [FeatureBlock("stereo_points", marks=self.marks)]

    @property
    def gain(self) -> float:
        """The slower of the two rates."""
        return min(self.rotation, self.translation)

    def bound_law(self, regulated: BoundFeatures) -> PlacingLaw:
        """Return the law for the frame that holds the target.

        Raises InputError if a camera moves, or if the marks lie on one line.
        """
        for points in (regulated.sights[0].target.marks[list(self.marks)], regulated.s_goal):
            if is_collinear(points.reshape(3, 3)):
                raise InputError(
                    "the placing law needs three marks that are not on one line, now and at the "
                    f"goal, got {points.reshape(3, 3).tolist()}"
                )
        for sight in regulated.sights:
            carried = sight.scene.tree.flag_velocities(sight.eye.name)[regulated.columns]
            if carried.any():
                raise InputError(
                    f"the placing law is for cameras that stand still, and '{sight.eye.name}' "
                    "moves with the joints"
                )
        return PlacingLaw(regulated.sights[0], regulated.columns, regulated.s_goal, self)


@dataclass(frozen=True, eq=False)
class PlacingLaw(CompiledLaw):
    """Law of `Placing`, for one camera and the joints that move its target."""

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
        V = self._add_twist(program, now, goal)
        program.add(kernels.shift_twist_reference, T=T, twist=V)
        moves = tree.moves(tree.flag_moves(held_by), self.columns)
        J = placed.base_jacobian(T, moves)
        rows = of._replace(J=J, inverse=PseudoInverse())
        qd = add_joint_velocities(rows, V, program.constant(self.task.length))
        return lambda gain: qd

    def _add_twist(self, program: Program, now: BlockRows, goal: BlockRows) -> BlockRows:
        """Add the stages of `twist`; return its rows (6,)."""
        task, marks = self.task, {"now": now, "goal": goal}
        turn, move = program.constant(task.rotation), program.constant(task.translation)
        options = {"gain": turn, "completed": task.variant == "completed"}
        V = program.result(kernels.compute_alignment_rotation, "twist", 6, **marks, **options)
        sign = 1 if task.variant == "printed" else -1
        program.add(kernels.compute_alignment_velocity, **marks, gain=move, sign=sign, twist=V)
        return V

    def twist(self, now: Array, goal: Array) -> tuple[Array, Array]:
        """Return T and Omega (3, B) at the world origin, from a, b, c (3, 3, B) in world axes."""
        (V,) = evaluate_stages(lambda *rows: [self._add_twist(*rows)], [now, goal])
        return V[:3], V[3:]
