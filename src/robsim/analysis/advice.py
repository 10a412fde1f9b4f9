"""`advise`: what to expect of an experiment near its goal, before it is simulated."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import reduce
from typing import Any

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
from robsim.analysis.linearisation.stability_limit import find_largest_factor, find_limiting_cause
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

SHOWN_EFFECTS = 5  # effects in a text


@dataclass(frozen=True, eq=False)
class Advice(Value):
    """What to expect of an experiment near its goal, from its linear loop there.

    gain          of the task at zero error, per second, the largest of several; NaN where a task of
                  one's own has none
    largest_gain  above which the loop no longer settles, per second; infinite if there is none, 0
                  if the loop is unstable at every gain
    margin        how many times all gains can be multiplied until then
    limited_by    what that comes from, in words
    rate          at which the slowest motion decays, per second, without delays
    noise         what noise leaves (`NoiseFloor`: pixels, metres, radians); zero without noise
    q             (nq,) where the experiment comes to rest
    metres, radians   by which the camera stands off its goal there; NaN where no pose is its goal
    effects       of a small mistake in each number that is believed (`MiscalibrationEffect`), most harmful first
    notes         what this cannot say

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

    @property
    def stability(self) -> str:
        """The gain and its limit, in a line."""
        gain = "" if math.isnan(self.gain) else f"gain {format_number(self.gain)}: "
        if self.margin == 0.0:
            return f"{gain}unstable at every gain: some motions lead away from the goal"
        limit = f"stable up to {format_number(self.largest_gain)} per second"
        if math.isnan(self.gain):
            limit = f"stable up to {format_number(self.margin)} times the gains"
        far = f"{format_number(self.margin)} times below"
        if self.margin < 1.0:
            far = f"{format_number(1.0 / self.margin)} times too high"
        return f"{gain}{limit} (limited by {self.limited_by}); {far}"

    def __str__(self) -> str:
        """Return a few lines: stability, noise, the end, what harms most, and notes."""
        return "\n".join(f"{name}: {text}" if name else text for name, text in self._rows())

    def __repr__(self) -> str:
        """Return one line, the gain and its limit."""
        return f"Advice({self.stability})"

    def _repr_html_(self) -> str:
        """Return what `print` shows as a table for notebooks."""
        return format_html_table(self.stability, self._rows()[1:])

    def _rows(self) -> list[tuple[str, str]]:
        rows = [("", self.stability), ("Noise", self._noise())]
        if not math.isnan(self.metres):
            off = f"{format_offset(self.metres, self.radians)} off the goal"
            rows.append(("End", off if self.metres or self.radians else "at the goal"))
        harmful = [str(one) for one in self.effects if one.notable][:SHOWN_EFFECTS]
        if not any(one.moves for one in self.effects):
            rows.append(("Calibration", "no small mistake moves the end" + ", but" * bool(harmful)))
        rows += [("Mistake", one) for one in harmful]
        return rows + [("Note", note) for note in self.notes]

    def _noise(self) -> str:
        noise = self.noise
        if not math.isfinite(noise.pixels):
            return "nothing settles"
        if not noise.pixels:
            return "none"
        return f"{format_number(noise.pixels)} px -> {format_offset(noise.metres, noise.radians)} (rms)"


def advise(experiment: Experiment) -> Advice:
    """Advise on gain, noise and calibration of an experiment, without simulating its loop.

    At the goal the command is linear in the motion and in the errors of the image, by central
    differences of the controller itself, whatever its law and what it believes. With the times of
    the loop (control period, rare and late images, joints that lag) this gives the map from one
    image to the next. The gain is stable while all eigenvalues of the map are within the unit
    circle (Franklin, Powell and Workman 1998, "Digital Control of Dynamic Systems"; of lost images
    the mean square is taken). The noise that remains follows from the discrete Lyapunov equation
    of the same map; where a mistake dp in what is believed moves the end, from
    dq = -(dqd/dq)^-1 (dqd/dp) dp.

    It holds near the goal, and says nothing of the way there, where marks are lost and joints reach
    their limits. A goal that was not shown has its end found by a run without errors of images and
    joints.

    InputError: a mission or a task that follows a path; a task that remembers (Broyden,
    DepthFilter, estimated feed-forward) or docks; several runs; a scene or a car that moves
    otherwise than by commanded velocities; a goal at which nothing comes to rest.

    >>> from robsim import examples, load_scenario
    >>> advice = advise(load_scenario(examples.path("latency_and_gain")))
    >>> print(advice.stability)
    gain 10: stable up to 15.5 per second (limited by 80 ms of latency); 1.55 times below
    """
    _check_linear(experiment)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)  # what is left free is a note
        linear = LinearLoop.of(experiment)
        return _compute_advice(experiment, linear)


def _check_linear(experiment: Experiment) -> None:
    """Raise InputError for what has no linear loop."""
    check_instance(experiment, Experiment, "experiment")
    task, who = experiment.task, f"{CALLER}: "
    if isinstance(task, SelfSimulatingTask):
        raise InputError(f"{who}a mission has a loop for each phase: take one of its tasks")
    if experiment.varied or np.ndim(experiment.start) > 1:
        raise InputError(f"{who}there are several runs: take one experiment, of_run(i)")
    if isinstance(task, FollowJoints | FollowPath):
        raise InputError(f"{who}{type(task).__name__} goes by the time, and servos on no image")
    if experiment.scene.tree.cars:
        raise InputError(f"{who}a car at rest cannot turn, so that no linear loop stands for it")
    experiment.check(view=False)


def _compute_advice(experiment: Experiment, linear: LinearLoop) -> Advice:
    gains: list[Any] = [leaf.gain for leaf in list_servo_tasks(linear.task)]
    gain = max(map(float, gains), default=math.nan)
    margin = find_largest_factor(linear.scaled, linear.timing)
    metres, radians = _final_offset(experiment, linear)
    return Advice(
        gain=gain,
        largest_gain=gain * margin,
        margin=margin,
        limited_by=find_limiting_cause(experiment, linear, gain),
        rate=float(linear.scaled.rates[0].real),
        noise=_noise_floor(experiment, linear),
        q=linear.q[:, 0].copy(),
        metres=metres,
        radians=radians,
        effects=compute_effects(linear),
        notes=tuple(generate_caveats(experiment, linear)),
    )


def _noise_floor(experiment: Experiment, linear: LinearLoop) -> NoiseFloor:
    """Return what noise of images and encoders leaves."""
    field = linear.field
    each = (one.effect.deviation(field.scene) for one in experiment.actuation.acting())
    measured = reduce(np.hypot, each, np.zeros(field.scene.nq))
    rows = field.scene.tree.alone(field.controller.columns)
    encoder = np.where(rows >= 0, measured[rows], 0.0)
    pixel = pixel_deviation(experiment.sensing, has_robust_weighting(experiment.task))
    return compute_noise_floor(linear.response, linear.scaled, linear.timing, pixel, encoder)


def _final_offset(experiment: Experiment, linear: LinearLoop) -> tuple[float, float]:
    """Return metres and radians of the first camera off its goal, where it comes to rest."""
    controller, q = linear.field.controller, linear.q
    _, metres, radians = end_variables.measure_goal_offset(controller, q, q.T)
    return zero_rounding(float(metres[0])), zero_rounding(float(radians[0]))
