"""Controllers: a task bound to a scene, with everything that is constant during a run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.command import Decision
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.laws.command_quantity import CommandQuantity
from robsim.vision.detectors.mark_detector import MarkDetector
from robsim.world.scene import Scene

LAST_STEPS = "_last_steps"  # attribute of a controller that may keep the stages of its last run


@dataclass(frozen=True, eq=False)
class TaskController(ABC):
    """Constant part of a control loop: a task bound to a scene.

    Attributes
    ----------
    scene : Scene
        True scene.
    frame : str
        Frame with the recorded motion: the first camera, or the moved frame of a task without
        cameras.
    sights : tuple of CameraTarget
        True cameras and targets.
    columns : ndarray of int
        Indices of the commanded velocities.
    s_goal : ndarray of shape (k, 1) or (k, runs)
        Features at the goal; one column for each run if they differ.
    units : tuple of str
        Units of the features.
    tolerances : ndarray of shape (k,)
        Tolerances of the features.
    goal_pixels : ndarray of shape (N, 2) or (runs, N, 2)
        Pixels of all marks at the goal; NaN without an image.
    pace : float or ndarray of shape (runs,)
        Slowest decay rate of the error, in 1/s.
    full_rank : int or ndarray of shape (runs,)
        Rank of L J away from singularities.
    rcond : float
        Relative size below which a singular value counts as zero.
    """

    scene: Scene
    frame: str
    sights: tuple[CameraTarget, ...]
    columns: NDArray[np.int64]
    s_goal: Array
    units: tuple[str, ...]
    tolerances: Array
    goal_pixels: Array
    pace: Any  # Any: one number, or an array (runs,)
    full_rank: Any  # Any: one number, or an array (runs,)
    rcond: float

    @abstractmethod
    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of one instant to a program; return the rows that they write."""

    @property
    def command_quantity(self) -> CommandQuantity:
        """Quantity of the command, of velocities or torques."""
        return "velocity"

    @property
    def has_weights(self) -> bool:
        """Whether the components of s have weights that change."""
        return False

    @property
    def optional_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with marks that may leave the image."""
        return frozenset()

    @property
    def detectors(self) -> Mapping[PairKey, MarkDetector]:
        """Detectors of the camera-target pairs with marks that are detected in pictures."""
        return {}

    @property
    def believed_sights(self) -> Mapping[PairKey, CameraTarget]:
        """Believed camera-target pairs, which are all that a detector knows."""
        return {}

    @property
    def pictured_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature of whole pictures."""
        return frozenset()

    @property
    def factor_count(self) -> int:
        """Number of entries of the factors of normal equations, of all features of pictures."""
        return 0

    @property
    def constraint_labels(self) -> tuple[str, ...]:
        """Names of the constraints of the law."""
        return ()

    @property
    def picture_cameras(self) -> list[str]:
        """Names of the cameras whose pictures detectors or features use, in order."""
        return list(self.picture_sights)

    @cached_property
    def picture_sights(self) -> Mapping[str, CameraTarget]:
        """A true pair of each camera whose pictures detectors or features use, in order."""
        used = {camera for camera, _ in (*self.detectors, *self.pictured_pairs)}
        sights = {sight.eye.name: sight for sight in self.sights}
        return {name: sights[name] for name in sorted(used)}

    @property
    def whole(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature that needs all marks, such as an unweighted pose."""
        return frozenset()

    def check_start(self, q0: Array) -> None:  # noqa: B027 most controllers accept every start
        """Raise InputError if the task is possible from none of the starts q0 (B, nq)."""

    def scale_to_tolerances(self, decision: Decision) -> Decision:
        """Return a decision with error and task Jacobian scaled to one tolerance."""
        scale = self.tolerance_scale[:, None]
        if (scale == 1.0).all():
            return decision
        command = decision.command
        error = command.error * scale
        task_jacobian = command.task_jacobian * scale[:, None]
        return decision._replace(command=command._replace(error=error, task_jacobian=task_jacobian))

    @property
    def k(self) -> int:
        """Number of features."""
        return len(self.s_goal)

    @property
    def marks(self) -> int:
        """Number of marks of all camera-target pairs."""
        return int(self.goal_pixels.shape[-2])

    @cached_property
    def moving(self) -> str:
        """Frame of the measured path: `frame`, or the target of a fixed camera."""
        stands = self.sights and not self.sights[0].camera_moves
        return self.sights[0].target.name if stands else self.frame

    @property
    def tolerance(self) -> float:
        """Tolerance of the first feature; the other features are scaled to it."""
        return float(self.tolerances[0])

    @cached_property
    def tolerance_scale(self) -> Array:
        """Factors (k,) that scale the features to the tolerance of the first one."""
        return np.asarray(self.tolerance / self.tolerances)
