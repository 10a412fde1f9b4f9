"""`advise`: predict the behaviour of an experiment near its goal, before it is simulated."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.analysis.explanation.text_format import format_number, format_offset
from robsim.analysis.linearisation.caveats import generate_caveats
from robsim.analysis.linearisation.linear_loop import CALLER, LinearLoop
from robsim.analysis.linearisation.miscalibration_effects import (
    MiscalibrationEffect,
    compute_effects,
    zero_rounding,
)
from robsim.analysis.linearisation.noise_floor import (
    NoiseFloor,
    compute_noise_floor,
    pixel_deviation,
)
from robsim.analysis.linearisation.stability_limit import find_limiting_cause, find_loop_limit
from robsim.analysis.task_tree import has_robust_weighting, list_servo_tasks
from robsim.base.arrays import Array
from robsim.base.errors import InputError, RankWarning
from robsim.base.html import format_html_table
from robsim.base.value import Value
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.run.run_checks import check_instance
from robsim.servo.tasks.follow_joints import FollowJoints
from robsim.servo.tasks.follow_path import FollowPath

if TYPE_CHECKING:  # few experiments have drives
    from robsim.analysis.linearisation.drive_advice import DriveAdvice

SHOWN_EFFECTS = 5  # effects in the printed text


@dataclass(frozen=True, eq=False)
class Advice(Value):
    """Predicted behaviour of an experiment near its goal, from the linearised loop.

    `print` shows the stability, the noise floor, the offset at the end, the most harmful errors of
    calibration, and caveats.

    Attributes
    ----------
    gain : float
        Gain of the task at zero error, in 1/s: the largest gain if there are several, NaN if the
        task has no single gain.
    largest_gain : float
        Largest stable gain, in 1/s: infinite if every gain is stable, 0 if none is.
    margin : float
        Largest stable factor of all gains.
    limited_by : str
        Main cause of the limit of the gain, in words.
    rate : float
        Decay rate of the slowest motion without delays, in 1/s.
    noise : NoiseFloor
        Jitter that noise causes at the end, in pixels, metres and radians; zero without noise.
    q : ndarray of shape (nq,)
        Coordinates of the scene at rest.
    metres, radians : float
        Distance and angle of the camera from its goal at rest. NaN if the goal has no known pose.
    effects : tuple of MiscalibrationEffect
        Effects of a small error in each believed number, most harmful first.
    notes : tuple of str
        Caveats: properties of the experiment that the linear loop neglects.
    drive : DriveAdvice or None
        Joint that limits the gain, and errors at rest by weight and friction, with a drive.

    Examples
    --------
    >>> from robsim import advise, examples, load_scenario
    >>> advice = advise(load_scenario(examples.path("noise_floor")))
    >>> round(advice.margin, 3), round(advice.noise.pixels, 3), advice.effects[0].unit
    (10.0, 0.408, '1 %')
    """

    gain: float
    largest_gain: float
    margin: float
    limited_by: str
    rate: float
    noise: NoiseFloor
    q: Array
    metres: float
    radians: float
    effects: tuple[MiscalibrationEffect, ...]
    notes: tuple[str, ...]
    drive: DriveAdvice | None = None

    @property
    def stability(self) -> str:
        """The gain and its limit, in one line."""
        gain = "" if math.isnan(self.gain) else f"gain {format_number(self.gain)}: "
        if self.margin == 0.0:
            return f"{gain}unstable at every gain: some motions lead away from the goal"
        limit = f"stable up to {format_number(self.largest_gain)} per second"
        if math.isnan(self.gain):
            limit = f"stable up to {format_number(self.margin)} times the gains"
        factor = f"{format_number(self.margin)} times below"
        if self.margin < 1.0:
            factor = f"{format_number(1.0 / self.margin)} times too high"
        return f"{gain}{limit} (limited by {self.limited_by}); {factor}"

    def __str__(self) -> str:
        """Return a few lines: stability, noise, offset at the end, harmful errors, caveats."""
        return "\n".join(f"{name}: {text}" if name else text for name, text in self._rows())

    def __repr__(self) -> str:
        """Return the gain and its limit in one line."""
        return f"Advice({self.stability})"

    def _repr_html_(self) -> str:
        """Return the printed text as a table for notebooks."""
        return format_html_table(self.stability, self._rows()[1:])

    def _rows(self) -> list[tuple[str, str]]:
        rows = [("", self.stability), ("Noise", self._noise())]
        if not math.isnan(self.metres):
            offset = f"{format_offset(self.metres, self.radians)} off the goal"
            rows.append(("End", offset if self.metres or self.radians else "at the goal"))
        rows += [] if self.drive is None else self.drive.rows()
        harmful = [str(one) for one in self.effects if one.notable][:SHOWN_EFFECTS]
        if not any(one.moves for one in self.effects):
            rows.append(("Calibration", "no small mistake moves the end" + ", but" * bool(harmful)))
        rows += [("Mistake", one) for one in harmful]
        return rows + [("Note", note) for note in self.notes]

    def _noise(self) -> str:
        noise = self.noise
        if not math.isfinite(noise.pixels):
            return "unbounded: the loop is unstable"
        if not noise.pixels:
            return "none"
        offset = format_offset(noise.metres, noise.radians)
        return f"{format_number(noise.pixels)} px -> {offset} (rms)"


def advise(experiment: Experiment) -> Advice:
    """Predict gain margin, noise and calibration effects of an experiment without simulating it.

    At the goal the command is a linear function of the motion and of the image errors. Its
    derivatives are central differences of the controller itself, so that every law and every belief
    is supported. Derivatives and timing (control period, interval and latency of the images, lag of
    the joints) determine the linear map of the state from one image to the next. The loop is stable
    if all eigenvalues of this map lie within the unit circle (Franklin, Powell and Workman 1998,
    "Digital Control of Dynamic Systems"). If images are lost, the mean square of the state must
    decay. The jitter that noise causes follows from the discrete Lyapunov equation of the same map.

    With a drive the map is that of the simulated sub-steps, differentiated about rest without
    Coulomb friction and limits of torques. Held torques at the joints, such as a weight that the
    drive does not hold, displace the state of rest of the same map.

    An error dp of a believed number displaces the state of rest by

        dq = -(dqd/dq)^-1 (dqd/dp) dp.

    The prediction holds near the goal. It does not cover the path to the goal: marks may be lost
    there, and joints may reach their limits. A goal given as numbers has no known state of rest; a
    run without image and joint errors then determines it.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a single start.

    Returns
    -------
    Advice
        The predictions; `print` shows them.

    Raises
    ------
    InputError
        If the experiment is a mission, follows a path, or has several runs; if its task has memory
        (Broyden, DepthFilter, estimated feed-forward) or is docking; if the scene has a car or
        prescribed motions; or if the task has no state of rest near the goal.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> advice = advise(load_scenario(examples.path("latency_and_gain")))
    >>> print(advice.stability)
    gain 10: stable up to 15.5 per second (limited by 80 ms of latency); 1.55 times below
    """
    _check_linear(experiment)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)  # free motions are reported as a caveat
        linear = LinearLoop.of(experiment)
        return _compute_advice(experiment, linear)


def _check_linear(experiment: Experiment) -> None:
    """Raise InputError if the experiment has no linear loop."""
    check_instance(experiment, Experiment, "experiment")
    task, start, prefix = experiment.task, experiment.start, f"{CALLER}: "
    if isinstance(task, SelfSimulatingTask):
        raise InputError(f"{prefix}a mission has a loop for each phase: give the task of one phase")
    if experiment.varied or (start is not None and start.ndim > 1):
        raise InputError(f"{prefix}expected one run, got several: give experiment.of_run(i)")
    if isinstance(task, FollowJoints | FollowPath):
        raise InputError(f"{prefix}{type(task).__name__} follows a trajectory and uses no image")
    if experiment.scene.tree.cars:
        raise InputError(f"{prefix}a car at rest cannot turn, and so it has no linear loop")
    experiment.check(view=False)


def _compute_advice(experiment: Experiment, linear: LinearLoop) -> Advice:
    gains: list[Any] = [leaf.gain for leaf in list_servo_tasks(linear.task)]
    gain = max(map(float, gains), default=math.nan)
    margin = find_loop_limit(linear)
    metres, radians = _final_offset(experiment, linear)
    return Advice(
        gain=gain,
        largest_gain=gain * margin,
        margin=margin,
        limited_by=find_limiting_cause(experiment, linear, gain),
        rate=float(linear.gain_dependence.rates[0].real),
        noise=_noise_floor(experiment, linear),
        q=linear.q[:, 0].copy(),
        metres=metres,
        radians=radians,
        effects=compute_effects(linear),
        notes=tuple(generate_caveats(experiment, linear)),
        drive=_advise_drives(linear),
    )


def _advise_drives(linear: LinearLoop) -> DriveAdvice | None:
    """Return the effects of the drives; None without a drive."""
    if linear.drives is None:
        return None
    from robsim.analysis.linearisation.drive_advice import advise_drives

    return advise_drives(linear)


def _noise_floor(experiment: Experiment, linear: LinearLoop) -> NoiseFloor:
    """Return the jitter caused by the noise of images and encoders."""
    field = linear.field
    deviations = (one.effect.deviation(field.scene) for one in experiment.actuation.list_active())
    joint_deviation = reduce(np.hypot, deviations, np.zeros(field.scene.nq))
    rows = field.scene.tree.alone(field.controller.columns)
    encoder = np.where(rows >= 0, joint_deviation[rows], 0.0)
    detectors = field.controller.detectors.values()
    pixel = pixel_deviation(experiment.sensing, has_robust_weighting(experiment.task), detectors)
    return compute_noise_floor(
        linear.response, linear.gain_dependence, linear.timing, pixel, encoder, linear.driven
    )


def _final_offset(experiment: Experiment, linear: LinearLoop) -> tuple[float, float]:
    """Return the distance (m) and angle (rad) of the first camera from its goal at rest."""
    controller, q = linear.field.controller, linear.q
    _, metres, radians = end_variables.measure_goal_offset(controller, q, q.T)
    return zero_rounding(float(metres[0])), zero_rounding(float(radians[0]))
