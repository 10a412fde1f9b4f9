"""`RunAnalysis`: a run to be explained, with its diagnosis and trial runs with changes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.analysis.explanation.ablation import (
    AblationTrial,
    ExperimentChange,
    extend_duration,
    run_trial,
)
from robsim.analysis.explanation.goal_search import NearestPose, find_nearest_pose
from robsim.analysis.explanation.text_format import format_quantity
from robsim.analysis.instant_measures import InstantMeasures
from robsim.analysis.resimulation import Resimulation
from robsim.analysis.task_tree import list_servo_tasks
from robsim.analysis.vector_fields import compute_target_pose
from robsim.base.arrays import Array, move_runs_last
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.servo.camera_target import CameraTarget
from robsim.servo.command import LawInput
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.law import Law
from robsim.servo.servo_controller import ServoController


@dataclass(frozen=True, eq=False)
class RunAnalysis(Resimulation):
    """A resimulated run, and whether trial runs with changes are allowed."""

    trials: bool

    @cached_property
    def measures(self) -> InstantMeasures:
        """The measures of the diagnosis at every instant."""
        return InstantMeasures(self)

    @property
    def servo(self) -> ServoController | None:
        """The controller of a single servo task; None for other tasks."""
        return self.controller if isinstance(self.controller, ServoController) else None

    @cached_property
    def gain(self) -> float:
        """The largest gain of the task in 1/s; NaN for a user-defined kind of task."""
        gains = [leaf.gain for leaf in list_servo_tasks(self.case.task)]
        numbers = (each.at_zero if isinstance(each, AdaptiveGain) else each for each in gains)
        return max(numbers, default=math.nan)

    @property
    def last(self) -> LawInput | None:
        """The basis of the last command; None unless the run has a single servo task."""
        basis = self.last_decision.basis
        return basis if isinstance(basis, LawInput) else None

    def last_basis_under(self, law: type[Law]) -> LawInput | None:
        """Return the basis of the last command if the law has exactly this type, else None."""
        return self.last if self.servo and type(self.servo.law) is law else None

    @cached_property
    def errors(self) -> Array:
        """The largest measured error max|e| (T,) at each instant."""
        sizes: Array = np.abs(self.history.state.command.error).max(axis=0)
        return sizes

    @property
    def late_errors(self) -> Array:
        """The errors of the last third of the run, at least three instants."""
        return self.errors[-max(len(self.errors) // 3, 3) :]

    @cached_property
    def depths(self) -> Array:
        """The mean true depth (T,) of the marks in the first camera, in metres."""
        depths = self.history.state.projections[self.sight.key].depth
        means: Array = np.ascontiguousarray(depths.T).mean(axis=1)
        return means

    @property
    def sight(self) -> CameraTarget:
        """The first camera and its target in the true scene."""
        return self.controller.sights[0]

    @cached_property
    def goal_pose(self) -> Pose | None:
        """The intended pose T_c_o at the goal; None for a goal given as numbers."""
        T = end_variables.get_camera_goal(self.controller)
        return None if T is None else Pose(homogeneous_matrix(T)[0])

    @cached_property
    def nearest(self) -> NearestPose | None:
        """The pose with the features nearest to a goal given as numbers; None for other goals."""
        ends = (self.first_state.q, self.last_state.q)
        poses = [compute_target_pose(self.sight, q)[0] for q in ends]
        return None if self.servo is None else find_nearest_pose(self.servo, poses, self.depths[0])

    @cached_property
    def start_rotation(self) -> Array | None:
        """The rotation vector (3,) from the goal to the start, in camera axes."""
        if self.goal_pose is None:
            return None
        sight = end_variables.select_goal_controller(self.controller).sights[0]
        start = compute_target_pose(sight, move_runs_last(np.asarray(self.case.start), 1))[0]
        return (self.goal_pose @ start.inv()).rotvec

    @property
    def end(self) -> float:
        """The duration of the run in seconds."""
        return (self.history.length - 1) * self.case.dt

    @property
    def tolerance(self) -> float:
        """The tolerance of the error."""
        return self.controller.tolerance

    def value(self, name: str, t: int = -1) -> float:
        """Return one number of the diagnosis, by default at the end."""
        return float(self.measures[name][t])

    def trial(self, change: ExperimentChange) -> AblationTrial | None:
        """Simulate the case with a change and enough time; return None without trials."""
        return run_trial(change(self.extended_case)) if self.trials else None

    @property
    def extended_case(self) -> Experiment:
        """The case with a longer duration, estimated from the decay of the error."""
        return extend_duration(self.case, self.arrival_time / self.end if self.end else 0.0)

    @property
    def is_falling(self) -> bool:
        """Whether the error is still falling at the end."""
        third = self.late_errors
        if self.decay > 0.2 * self.gain and (np.diff(third) < 0).all():
            return True  # as fast as the gain allows
        return self.decay * len(third) * self.case.dt > 0.05 and bool(third[-1] < 1.2 * third.min())

    @property
    def arrival_time(self) -> float:
        """The estimated time in seconds of convergence; NaN if the error does not fall."""
        size = self.errors[-1]
        if not self.decay > 0 or not size > self.tolerance:
            return math.nan
        return self.end + float(np.log(size / self.tolerance)) / self.decay

    @property
    def is_converging(self) -> bool:
        """Whether the error falls, and would fall below the tolerance."""
        return self.is_falling and math.isfinite(self.arrival_time)

    def size(self, error: float) -> str:
        """Return an error as text with its unit."""
        return format_quantity(error, self.controller.units[0])

    @cached_property
    def decay(self) -> float:
        """The decay rate of the error in the last third of the run in 1/s, by least squares."""
        sizes = self.late_errors
        if len(sizes) < 2 or not (sizes > 0).all() or not np.isfinite(sizes).all():
            return math.nan
        times = np.arange(len(sizes)) * self.case.dt
        return -float(np.polyfit(times, np.log(sizes), 1)[0])
