"""Controllers: a task bound to a scene, with all that stays the same while it runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.command import Decision
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class TaskController(ABC):
    """The constant part of a control loop: a task bound to a scene."""

    scene: Scene  # the true one
    frame: str  # whose motion is recorded: its first camera, or what it moves where it has none
    sights: tuple[CameraTarget, ...]  # cameras and targets as they are
    columns: NDArray[np.int64]  # the velocities that are commanded
    s_goal: Array  # (k, 1), or (k, runs) where each run has its own
    units: tuple[str, ...]  # (k,)
    tolerances: Array  # (k,)
    goal_pixels: Array  # (N, 2) of all sights or (runs, N, 2), NaN where no image is known
    pace: Any  # the slowest rate at which the error is to decay, per second, () or (runs,)
    full_rank: Any  # of L J where nothing is singular, () or (runs,)
    rcond: float

    @abstractmethod
    def stages(self, given: ControllerInputs) -> ControllerOutputs:
        """Add the stages of an instant to a program, and return the rows that they write."""

    @property
    def weighted(self) -> bool:
        """Whether the numbers of s have weights that change."""
        return False

    @property
    def excused(self) -> frozenset[PairKey]:
        """The sights whose marks may leave the image."""
        return frozenset()

    @property
    def whole(self) -> frozenset[PairKey]:
        """The sights of which a feature needs all marks at once, as a pose without weights does."""
        return frozenset()

    def check_start(self, q0: Array) -> None:  # noqa: B027 most controllers start anywhere
        """Raise InputError if the task can be done from none of the starts q0 (B, nq)."""

    def scaled(self, decision: Decision) -> Decision:
        """Return a decision with error and task Jacobian scaled to one tolerance."""
        if self._scale is None:
            return decision
        command = decision.command
        error = command.error * self._scale
        task_jacobian = command.task_jacobian * self._scale[:, None]
        return decision._replace(command=command._replace(error=error, task_jacobian=task_jacobian))

    @property
    def k(self) -> int:
        """The number of features."""
        return len(self.s_goal)

    @property
    def marks(self) -> int:
        """The number of marks of all sights."""
        return int(self.goal_pixels.shape[-2])

    @cached_property
    def moving(self) -> str:
        """The frame whose path is measured: `frame`, or the target of a standing camera."""
        stands = self.sights and not self.sights[0].camera_moves
        return self.sights[0].target.name if stands else self.frame

    @property
    def tolerance(self) -> float:
        """The tolerance of the first feature, to which the others are scaled."""
        return float(self.tolerances[0])

    @cached_property
    def _scale(self) -> Array | None:
        scale = self.tolerance / self.tolerances
        return None if (scale == 1.0).all() else scale[:, None]
