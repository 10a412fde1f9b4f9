"""The features of position-based servoing: rotation and translation of the camera from the goal."""

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
    """The base of features of T_c_o, the estimated pose of the target, and of the goal."""

    uses_pose: ClassVar[bool] = True
    uses_depth: ClassVar[bool] = False
    least_marks: ClassVar[int] = 3

    T_goal_o: Pose = field(default=IDENTITY, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_goal_o", check_single_pose(self.T_goal_o, "T_goal_o"))
        check_fields(self)

    def towards(self, goal: Observation) -> Self:
        """Return the feature relative to the camera with this view of the target."""
        if not np.isfinite(check_goal_observation(goal, type(self).__name__).pose).all():
            raise GoalError("no pose of the target fits what is seen at the goal")
        return replace_unchecked(
            self, T_goal_o=Pose(goal.pose[0] if len(goal.pose) == 1 else goal.pose)
        )

    def _from_goal(self, seen: ObservationRows) -> BlockRows:
        """Add the stage of T_goal_c, the camera in axes of the goal camera; return its rows."""
        goal, room = seen.program.each(self._T_o_goal), seen.program.rows(3, 4)
        given = {"T_c_o": seen.pose, "T_o_goal": goal, "room": room}
        return seen.program.result(kernels.goal_camera_pose_stage, "T", 3, 4, **given)

    @cached_property
    def _T_o_goal(self) -> Array:
        T = self.T_goal_o.inv().matrix
        return move_runs_last(T[..., :3, :], 2).reshape(3, 4, -1)


@register("feature", "theta_u")
@dataclass(frozen=True)
class ThetaU(_PoseFeature):
    """The rotation vector of the camera in the goal camera, s = theta u of R_goal_c, in radians.

    `T_goal_o` is the pose of the target in the goal camera; `towards` takes it from the view at
    the goal. L = [0, L_w], see `robsim.kernels.features.pose_features.theta_u_interaction` (Malis,
    Chaumette and Boudet 1999). theta is in [0, pi]; beyond, u turns round.

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
        T, room = self._from_goal(seen), seen.program.rows(4)
        return seen.computed(kernels.theta_u_stage, 3, T=T, room=room)


@register("feature", "translation")
@dataclass(frozen=True)
class Translation(_PoseFeature):
    """The position in metres of the camera in the goal camera, or of the target in the camera.

    form "goal": s = t_goal_c, the origin of the camera in axes of the goal camera, and
    L = [R_goal_c, 0]; with `ThetaU` the camera goes straight.
    form "camera": s = t_c_o, the origin of the target in camera axes, and L = [-I, [t_c_o]x];
    with `ThetaU` that origin goes straight in the image.
    Both are in Chaumette and Hutchinson 2006, the section on position-based servoing.

    >>> from robsim.vision.camera import Camera
    >>> image, pose = np.zeros((3, 2)), Pose.at(0.1, 0.2, 2)
    >>> seen = Observation.of(image, np.ones(3), Camera(np.eye(3)), pose=pose)
    >>> Translation(T_goal_o=Pose.at(0.2, 0.1, 1)).measure(seen)
    array([[ 0.1, -0.1, -1. ]])
    >>> Translation("camera").measure(seen)
    array([[0.1, 0.2, 2. ]])
    """

    form: Annotated[
        TranslationForm, Word(get_args(TranslationForm), "form"), "Which of the two translations."
    ] = "goal"
    tolerance: Tolerance = 1e-5
    unit: str = "m"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        in_goal = self.form == "goal"
        T = self._from_goal(seen) if in_goal else seen.pose
        return seen.computed(kernels.translation_stage, 3, T=T, in_goal=in_goal)
