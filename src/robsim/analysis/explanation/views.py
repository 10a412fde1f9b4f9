"""Quantities read from a repeated run: depths, target poses, errors and the loop gain."""

from __future__ import annotations

import math

import numpy as np

from robsim.analysis.explanation.wording import number
from robsim.analysis.leaves import leaves
from robsim.analysis.repeated import Repeated
from robsim.base.arrays import Array, runs_last
from robsim.geometry.pose import Pose, homogeneous
from robsim.run import ends
from robsim.run.experiment import Experiment
from robsim.servo.controller import Controller
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.servo_controller import Servo
from robsim.servo.sight import Sight, relative


def mean_depths(again: Repeated) -> Array:
    """Return the mean true depth (T,) of the marks in the first camera, in metres."""
    key = again.loop.controller.sights[0].key
    depths = [float(one.projections[key].depth.mean()) for one in again.snapshots]
    return np.array(depths, dtype=np.float64)


def errors(again: Repeated) -> Array:
    """Return the measured errors (T, k), scaled to one tolerance for all."""
    found: Array = np.stack([one.command.error[:, 0] for one in again.snapshots])
    return found


def largest_errors(again: Repeated) -> Array:
    """Return max|e| (T,), which is compared with the tolerance."""
    sizes: Array = np.abs(errors(again)).max(axis=1)
    return sizes


def size(again: Repeated, error: float) -> str:
    """Return an error as text with its unit."""
    unit = again.loop.controller.units[0]
    return number(error) if unit == "1" else f"{number(error)} {unit}"


def gain_of(case: Experiment) -> float:
    """Return the largest gain of the task, per second; NaN for a user's own kind of task."""
    gains = [leaf.gain for leaf in leaves(case.task)]
    return max((g.at_zero if isinstance(g, AdaptiveGain) else g for g in gains), default=math.nan)


def pose_at(sight: Sight, q: Array) -> Pose:
    """Return T_c_o: the true pose of the target in camera axes at q (nq,)."""
    seen = sight.project(runs_last(q, 1))
    return Pose(homogeneous(relative(seen.T_w_c, seen.T_w_o))[0])


def goal_pose(controller: Controller) -> Pose | None:
    """Return the intended T_c_o at the goal; None where the goal is made of numbers."""
    T = ends.at_goal(controller)
    return None if T is None else Pose(homogeneous(T)[0])


def from_goal(controller: Controller, q: Array) -> Pose | None:
    """Return T_c*_c: the camera at q (nq,) in axes of the camera at the intended goal."""
    goal = goal_pose(controller)
    return None if goal is None else goal @ pose_at(ends.regarded(controller).sights[0], q).inv()


def servo_of(again: Repeated) -> Servo | None:
    """Return the controller if it is that of one servo task, else None."""
    controller = again.loop.controller
    return controller if isinstance(controller, Servo) else None
