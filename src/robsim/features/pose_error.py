"""Pose errors: rotation and translation between the camera and its goal."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, ClassVar, Literal, Self, get_args

import numpy as np

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import GoalError
from robsim.base.value import replace_unchecked
from robsim.declare import Word, check_fields, register
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Observation, Tolerance, check_goal_observation
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.geometry.pose import IDENTITY, Pose, check_single_pose
from robsim.kernels.features import pose_features as kernels
from robsim.kernels.machine.block_rows import BlockRows

TranslationForm = Literal["goal", "camera"]


@dataclass(frozen=True)
class _PoseFeature(CompiledFeature):
    """Base of the features of the estimated pose T_c_o of the target relative to the goal."""

    uses_pose: ClassVar[bool] = True
    uses_depth: ClassVar[bool] = False
    least_marks: ClassVar[int] = 3

    T_goal_o: Pose = field(default=IDENTITY, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_goal_o", check_single_pose(self.T_goal_o, "T_goal_o"))
        check_fields(self)

    def towards(self, goal: Observation) -> Self:
        """Return the feature relative to the camera pose of a view of the target.

        Parameters
        ----------
        goal : Observation
            Observation of the marks at the goal.

        Returns
        -------
        ThetaU or Translation
            The feature with `T_goal_o` estimated from the observation.

        Raises
        ------
        InputError
            If `goal` is not an Observation.
        GoalError
            If no pose of the target fits the image at the goal.
        """
        if not np.isfinite(check_goal_observation(goal, type(self).__name__).pose).all():
            raise GoalError("no pose of the target fits the image at the goal")
        return replace_unchecked(
            self, T_goal_o=Pose(goal.pose[0] if len(goal.pose) == 1 else goal.pose)
        )

    def _add_goal_pose(self, seen: ObservationRows) -> BlockRows:
        """Add the stage of T_goal_c, the camera pose in goal camera axes; return its rows."""
        goal, room = seen.program.each(self._T_o_goal), seen.program.rows(3, 4)
        arguments = {"T_c_o": seen.pose, "T_o_goal": goal, "scratch": room}
        return seen.program.result(kernels.goal_camera_pose_stage, "T", 3, 4, **arguments)

    @cached_property
    def _T_o_goal(self) -> Array:
        T = self.T_goal_o.inv().matrix
        return move_runs_last(T[..., :3, :], 2).reshape(3, 4, -1)


@register("feature", "theta_u")
@dataclass(frozen=True)
class ThetaU(_PoseFeature):
    """Rotation vector of the camera relative to its goal, s = theta u of R_goal_c, in rad.

    The interaction matrix is L = [0, L_w] (Malis, Chaumette and Boudet 1999; see
    `robsim.kernels.features.pose_features.theta_u_interaction`). The translation of the camera
    does not enter, and the camera turns about one fixed axis to the goal. The pose of the target
    is estimated from its marks.

    `T_goal_o` is the pose of the target in goal camera axes; `towards` takes it from the view at
    the goal.

    Raises
    ------
    GoalError
        By `towards`, if no pose of the target fits the image at the goal.

    Notes
    -----
    theta is in [0, pi]. Beyond half a turn the axis u changes its sign.

    Examples
    --------
    >>> from robsim.vision.camera import Camera
    >>> image, pose = np.zeros((3, 2)), Pose.at(0, 0, 2, rotvec=(-0.5, 0, 0))
    >>> seen = Observation.of(image, np.ones(3), Camera(np.eye(3)), pose=pose)
    >>> np.round(ThetaU().measure(seen), 12) + 0.0
    array([[0.5, 0. , 0. ]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "rad"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        return seen.computed(kernels.theta_u_stage, 3, T=self._add_goal_pose(seen))


@register("feature", "translation")
@dataclass(frozen=True)
class Translation(_PoseFeature):
    """Position of the camera relative to its goal, or of the target in camera axes, in metres.

    - form "goal": s = t_goal_c, the origin of the camera in goal camera axes, with L = [R_goal_c,
      0]. Together with `ThetaU` the camera moves on a straight line.
    - form "camera": s = t_c_o, the origin of the target in camera axes, with L = [-I, [t_c_o]x].
      Together with `ThetaU` the origin of the target moves on a straight line in camera axes, and
      so in the image.

    Both are in Chaumette and Hutchinson 2006, section on position-based servoing. Use "goal" if
    the path of the camera matters, and "camera" if the target must stay in the image. The pose of
    the target is estimated from its marks.

    Raises
    ------
    GoalError
        By `towards`, if no pose of the target fits the image at the goal.

    Examples
    --------
    >>> from robsim.vision.camera import Camera
    >>> image, pose = np.zeros((3, 2)), Pose.at(0.1, 0.2, 2)
    >>> seen = Observation.of(image, np.ones(3), Camera(np.eye(3)), pose=pose)
    >>> Translation(T_goal_o=Pose.at(0.2, 0.1, 1)).measure(seen)
    array([[ 0.1, -0.1, -1. ]])
    >>> Translation("camera").measure(seen)
    array([[0.1, 0.2, 2. ]])
    """

    form: Annotated[
        TranslationForm,
        Word(get_args(TranslationForm), "form"),
        "Translation: of the camera from its goal, or of the target in camera axes.",
    ] = "goal"
    tolerance: Tolerance = 1e-5
    unit: str = "m"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        in_goal = self.form == "goal"
        T = self._add_goal_pose(seen) if in_goal else seen.pose
        return seen.computed(kernels.translation_stage, 3, T=T, in_goal=in_goal)
