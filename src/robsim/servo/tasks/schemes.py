"""Visual servo schemes of the textbooks: features with a law, for a given goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import Annotated, cast

import numpy as np

from robsim.base.errors import InputError
from robsim.base.value import construct_unchecked
from robsim.declare import Integer, PerRun, Word, register
from robsim.features.pose_error import Translation, TranslationForm
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_block import FeatureBlock, Features, IndexList
from robsim.servo.laws.broyden_rule import INTERACTION, Matrix
from robsim.servo.laws.inverse import INVERSE, Inverse
from robsim.servo.laws.law import UnitOfLength
from robsim.servo.laws.partitioned_law import AdvanceGain, PartitionedLaw, RollGain
from robsim.servo.shaping.command_fields import RedundancyFields
from robsim.servo.tasks.task_fields import (
    DepthFields,
    FeatureFields,
    Gain,
    LawFields,
    WeightingFields,
)

MODEL_INTERACTION = replace(INTERACTION, only=(), beside_of={})
TRUNCATION_ONLY = replace(
    INVERSE, only=("pseudo_inverse",), beside_of={"rcond": ("pseudo_inverse", "rcond")}
)


@register("task", "ibvs")
@dataclass(frozen=True, eq=False)
class IBVS(RedundancyFields, WeightingFields, LawFields, DepthFields, FeatureFields):
    """Image-based visual servoing: drive image features to their goal.

    The law commands joint velocities that make the feature error e = s - s* decay exponentially,

        edot = -gain e,    qdot = -gain (L J)^+ e,

    with the interaction matrix L of the features and the Jacobian J of the camera relative to the
    target (chapter, eqs. 5 to 8; Chaumette and Hutchinson 2006). Feature points move on nearly
    straight lines in the image. The path of the camera follows from the image: the camera may take
    detours, retreat under large rotations about the optical axis, or stop in a local minimum (see
    `diagnose`). Errors of the calibration bend the path but not the goal, if the goal was shown.
    Use `PBVS` if the path of the camera matters more than the image.

    The choice of `interaction` decides the path far from the goal:

    - "current" evaluates L at every instant. The image paths are the straightest; the camera
      retreats under large rotations.
    - "desired" is constant. It needs depths at the goal only; image paths bend far from the goal,
      and marks may leave the image.
    - "mean" averages both (Malis 2004) and avoids the retreat under large rotations.
    - "broyden" estimates L J from the motion, without a model of camera or robot.

    `depth` scales the translational part of the command: with depths that are too large the camera
    translates too fast, and the loop may become unstable. `gain` sets the time constant 1/gain of
    the error; delays of the image bound it (see `advise`).

    Raises
    ------
    InputError
        If fields contradict one another, or if the scene lacks a name or a joint.
    GoalError
        By `simulate`, if a mark of the goal is outside the image, or if s or L is not finite
        there.

    Examples
    --------
    A rotation by 120 degrees about the optical axis, without a translation:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("camera_retreat"))
    >>> goal = scenario.task.goal
    >>> for interaction in "current", "mean":
    ...     task = rs.IBVS(goal, interaction=interaction)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(rs.Outcome(int(run.outcome)).name, f"{float(run.path_length):.2f} m")
    CONVERGED 2.10 m
    CONVERGED 0.00 m
    """


@register("task", "pbvs")
@dataclass(frozen=True, eq=False)
class PBVS(RedundancyFields, WeightingFields, LawFields):
    """Position-based visual servoing: drive the estimated pose of the target to its goal.

    The features are a translation and the rotation vector theta u of the camera from its goal
    (Chaumette and Hutchinson 2006, section on position-based servoing),

        form "goal":    s = (c*t_c, theta u)
        form "camera":  s = (ct_o, theta u)

    with the law qdot = -gain (L J)^+ e. With form "goal" the camera moves on a straight line and
    turns about a fixed axis; with form "camera" the origin of the target moves on a straight line
    in the image. Both converge from any start with a rotation below half a turn. The image is not
    regulated: marks may leave it, more rarely with form "camera". Errors of the calibration and of
    the model of the target bend the path, and enter the final pose if the goal is a `GoalPose`.
    Use `IBVS` if the marks must stay in the image, or if the calibration is poor.

    The pose is estimated from the marks and the believed model of the target by least squares.
    Weights of the marks (`weighting`) enter this estimate.

    Raises
    ------
    InputError
        If fields contradict one another, or if the target has fewer than three marks or marks on
        one line.
    GoalError
        If the goal is `GoalFeatures`. By `simulate`, if a mark of the goal is outside the image.

    Examples
    --------
    The path of the camera is the straight line between start and goal:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> for task in rs.PBVS(scenario.task.goal), rs.IBVS(scenario.task.goal):
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(f"{float(run.path_length):.3f} m")
    0.350 m
    0.383 m
    """

    _: KW_ONLY
    form: Annotated[
        str,
        Word(("goal", "camera"), "form"),
        "Translation that is regulated: the camera in goal axes (straight path of the camera), or "
        "the target in camera axes (straight path in the image).",
    ] = "goal"

    @property
    def features(self) -> Features:
        """Translation and rotation of the camera relative to its goal."""
        return [Translation(cast(TranslationForm, self.form)), "theta_u"]


@register("task", "hybrid")
@dataclass(frozen=True, eq=False)
class Hybrid(RedundancyFields, WeightingFields, LawFields, DepthFields):
    """2 1/2 D visual servoing: s = (x, y, log(Z/Z*), theta u) of one mark and the rotation.

    Image coordinates control the translation, the estimated pose controls the rotation (Malis,
    Chaumette and Boudet 1999):

        s = (x, y, log(Z/Z*), theta u),    L = [L_v, L_w; 0, L_u].

    The mark moves on a straight line in the image, and the camera turns about a fixed axis. L is
    block triangular and singular only for degenerate views, so the scheme converges from nearly
    every start. It keeps one mark in the image; the others may leave it. Choose a `mark` near the
    centre of the target.

    Raises
    ------
    InputError
        If fields contradict one another, or if the target lacks the mark.
    GoalError
        If the goal is `GoalFeatures`. By `simulate`, if a mark of the goal is outside the image.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> task = rs.Hybrid(scenario.task.goal, mark=2)
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.path_length), 3)
    ('CONVERGED', 0.355)
    """

    _: KW_ONLY
    mark: Annotated[
        int, Integer(0, 9_999), "Index of the mark that moves on a straight line in the image."
    ] = 0

    @property
    def features(self) -> list[FeatureBlock]:
        """Image point and logarithmic depth of the mark, and the rotation of the camera."""
        blocks = [FeatureBlock(name, marks=(self.mark,)) for name in ("points", "log_depth")]
        return [*blocks, FeatureBlock("theta_u")]


@register("task", "partitioned")
@dataclass(frozen=True, eq=False)
class Partitioned(RedundancyFields, DepthFields):
    """Partitioned visual servoing: separate control of the optical axis.

    Two scalar features drive the optical axis, and the points drive the other four components of
    the camera twist (Corke and Hutchinson 2001),

        omega_z = roll (angle - angle*),    v_z = advance ln(sigma*/sigma),
        V_xy = L_xy^+ (-gain e - L_z V_z).

    The angle is the direction of the line through two marks (`segment`); sigma is the square root
    of the area of the polygon of all marks. The law is `PartitionedLaw(roll, advance, length)`.

    A rotation about the optical axis no longer causes the retreat of `IBVS`, since the angle alone
    commands it. `roll` and `advance` set the rates of rotation and approach relative to `gain`. A
    short segment makes the angle noisy.

    Raises
    ------
    InputError
        If fields contradict one another, or if no joint moves the camera along its optical axis.
    GoalError
        By `simulate`, if a mark of the goal is outside the image.

    Examples
    --------
    A rotation by 120 degrees about the optical axis does not move the camera:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("camera_retreat"))
    >>> task = rs.Partitioned(scenario.task.goal)
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.path_length), 3)
    ('CONVERGED', 0.0)
    """

    _: KW_ONLY
    interaction: Annotated[
        Matrix,
        MODEL_INTERACTION,
        "Interaction matrix L of the points: current, at the goal, the mean of both, or constant.",
    ] = "current"
    gain: Annotated[Gain, PerRun(())] = 1.0
    inverse: Annotated[Inverse, TRUNCATION_ONLY, "Inverse of L."] = "pseudo_inverse"
    segment: Annotated[
        tuple[int, int],
        IndexList(least=2, most=2),
        "Indices of two marks; the line through them gives the angle of roll.",
    ] = (0, 1)
    roll: RollGain = 1.0
    advance: AdvanceGain = 1.0
    length: UnitOfLength = 1.0

    @property
    def features(self) -> list[FeatureBlock]:
        """Points, the angle of the segment, and the area of the polygon of all marks."""
        angle = FeatureBlock("segments", marks=self.segment, components=(3,))
        area = FeatureBlock("region_moments", components=(0,))
        return [FeatureBlock("points"), angle, area]

    @property
    def law(self) -> PartitionedLaw:
        """Partitioned law with the gains of the task."""
        return construct_unchecked(
            PartitionedLaw, roll=self.roll, advance=self.advance, length=self.length
        )

    def bound_law(self, regulated: BoundFeatures) -> PartitionedLaw:
        """Return the law; raise InputError if no joint moves the camera along its optical axis."""
        if np.abs(regulated.at_goal.J[2]).max() < 1e-9:
            raise InputError(
                "the partitioned scheme moves the camera along its optical axis, and no commanded "
                f"joint moves '{regulated.sights[0].eye.name}' in this direction"
            )
        return self.law
