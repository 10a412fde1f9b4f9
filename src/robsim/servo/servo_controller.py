"""The controller of one servo task: features, error, law and shaping of the command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_first, view_runs_last
from robsim.base.errors import InputError
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.constraints.constraint import ConstraintPlace
from robsim.servo.constraints.constraint_stages import BoundConstraints
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.feature_stages import FACTOR
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.command_quantity import CommandQuantity, get_command_quantity
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.feed_forward import EstimatedMotion, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import (
    RCOND,
    SAME_UNITS,
    InverseKind,
    JacobianTranspose,
    compute_rank,
)
from robsim.servo.laws.law import Law
from robsim.servo.servo_stages import ServoStages
from robsim.servo.shaping.command_shaper import CommandShaper
from robsim.servo.task_controller import TaskController
from robsim.servo.user_return import check_returned_array
from robsim.servo.weightings.weighting_protocol import MarkWeighting, Weighting
from robsim.vision.detectors.mark_detector import MarkDetector


@dataclass(frozen=True, eq=False)
class ServoController(TaskController):
    """Controller of one servo task; its law drives e = s - s_goal to zero."""

    bound_features: BoundFeatures
    law: Law
    gain: float | AdaptiveGain | Array  # an array (runs,) has one gain for each run
    inverse: InverseKind
    feed_forward: KnownMotion | EstimatedMotion | None
    broyden: Broyden | None
    shaping: CommandShaper
    weighting: tuple[Weighting | MarkWeighting, ...] = ()
    detector: MarkDetector | None = None
    constraints: BoundConstraints | None = None

    @property
    def command_quantity(self) -> CommandQuantity:
        """Quantity of the command, of velocities or torques."""
        return get_command_quantity(self.law)

    @property
    def constraint_labels(self) -> tuple[str, ...]:
        """Names of the constraints of the law."""
        return self.constraints.labels if self.constraints else ()

    @property
    def constraint_place(self) -> ConstraintPlace:
        """Scene in which constraints of the law act."""
        bound = self.bound_features
        return ConstraintPlace(bound.sights[0].scene, bound.marked_sights, self.columns)

    @property
    def has_weights(self) -> bool:
        """Whether the components of s have weights that change."""
        return bool(self.weighting)

    @property
    def optional_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with marks that may leave the image."""
        excuses = any(getattr(each, "excuses", False) for each in self.weighting)
        every = frozenset(sight.key for sight in self.sights)
        return every if excuses else every - self._marked_pairs

    @property
    def pictured_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature of whole pictures."""
        return self.bound_features.pictured_pairs

    @property
    def factor_count(self) -> int:
        """Number of entries of the factors of normal equations, of all features of pictures."""
        return FACTOR.size * sum(part.models_interaction for part in self.bound_features.parts)

    @property
    def _marked_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature of marks."""
        return frozenset(sight.key for sight in self.bound_features.marked_sights)

    @property
    def detectors(self) -> Mapping[PairKey, MarkDetector]:
        """Detector of each camera-target pair, if the task has one."""
        detector = self.detector
        return {} if detector is None else {sight.key: detector for sight in self.sights}

    @property
    def believed_sights(self) -> Mapping[PairKey, CameraTarget]:
        """Believed camera-target pairs."""
        return {sight.key: sight for sight in self.bound_features.sights}

    @property
    def whole(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature that needs all marks; none with a weighting."""
        if self.weighting:
            return frozenset()
        parts = zip(self.bound_features.parts, self.bound_features.depends(), strict=True)
        keys = (
            sight.key
            for part, marks in parts
            if marks is not None and marks.shape[2] > 2 and marks.all()
            for sight in part.sights
        )
        return frozenset(keys)

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of one instant to a program; return the rows that they write."""
        stages = ServoStages(self, inputs)
        stages.assess()
        return stages.outputs(stages.command())

    def evaluate_law(self, state: ControlState) -> Array:
        """Return velocities (n, B) from the law, which may be a user's."""
        expected = (state.error_last.shape[1], self.columns.size)
        who = f"{type(self.law).__name__}.command"
        qd = check_returned_array(self.law.command(state), who, expected)
        return np.array(view_runs_last(qd), order="C")  # the user's array may change later

    @cached_property
    def one_motion(self) -> bool:
        """Whether L J is the product of one L and one J, and not an estimate."""
        return self.broyden is None and self.bound_features.has_single_motion


def compute_decay_rate(
    regulated: BoundFeatures, gain: float | AdaptiveGain | Array, inverse: InverseKind
) -> float | Array:
    """Return the slowest decay rate of the error in 1/s, () or (runs,): the gain.

    With the transpose the rate is the gain times the smallest sigma^2 of L J at the goal.
    """
    slowest = gain.least if isinstance(gain, AdaptiveGain) else gain
    if not isinstance(inverse, JacobianTranspose):
        return slowest
    task_jacobian = move_runs_first(regulated.at_goal.task_jacobian)
    if not task_jacobian.any() or not np.isfinite(task_jacobian).all():
        raise InputError(
            "the transpose needs L J at the goal, and there it is zero or not finite (of a goal "
            "given as numbers, at home): use another inverse"
        )
    sigma = np.linalg.svd(task_jacobian, compute_uv=False)
    smallest = np.where(sigma > RCOND * sigma[:, :1], sigma, np.inf).min(axis=1) ** 2
    return slowest * (smallest if len(smallest) > 1 else float(smallest[0]))


def compute_goal_rank(regulated: BoundFeatures) -> int | NDArray[np.int64]:
    """Return the rank of L J at the goal if it was shown, or else the largest possible rank.

    The result is (runs,) for several runs with individual goals.
    """
    goal = regulated.at_goal
    if regulated.goal_views.q_shown is None:
        return int(min(*goal.task_jacobian.shape[:2], 6 * regulated.motions))
    ranks = compute_rank(goal.task_jacobian, goal.J if regulated.has_single_motion else SAME_UNITS)
    return ranks if len(ranks) > 1 else int(ranks[0])


def get_rcond(inverse: InverseKind) -> float:
    """Return the relative size below which a singular value counts as zero."""
    return inverse.numbers[2] or RCOND
