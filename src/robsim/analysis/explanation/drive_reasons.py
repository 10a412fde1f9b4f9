"""Causes in driven joints that follow from their linear loop: unstable drives and high gains."""

from __future__ import annotations

import math
import warnings

import numpy as np

from robsim.analysis.explanation.counterfactuals import scale_gain
from robsim.analysis.explanation.drive_imperfections import (
    describe_saturation,
    remove_drive,
    remove_friction,
)
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.base.arrays import move_runs_last
from robsim.base.errors import InputError, RankWarning
from robsim.engine.driven_joints import DrivenJoints
from robsim.engine.outcome import Outcome

NEARER = 0.5  # largest share of the final error that remains without a cause
STABLE_SHARE = 0.4  # share of the largest gain that is tried


def report_unstable_drive(analysis: RunAnalysis) -> Finding | None:
    """Report a drive that is unstable by itself, with the command zero."""
    if analysis.loop.driven is None:
        return None
    rate = find_growth_rate(analysis)
    if rate is None or rate <= max(analysis.gain, 1.0):
        return None
    sentence = (
        f"{analysis.loop.driven.drive.label} is unstable by itself: with the command zero its "
        f"motion grows by a factor of {format_number(math.exp(rate * analysis.case.dt))} in each "
        f"period of {format_number(1000 * analysis.case.dt)} ms."
    )
    evidence = {"growth_rate": rate}
    ideal = analysis.trial(remove_drive)
    if ideal is not None:
        if ideal.converged:
            evidence["converges_after_s"] = ideal.end_time
        end = ideal.clause if ideal.converged else f"ends as {ideal.outcome.name} {ideal.end}"
        sentence += f" With joints that move exactly as commanded the run {end}."
    return Finding("unstable drive", sentence, evidence)


def find_growth_rate(analysis: RunAnalysis) -> float | None:
    """Return the largest growth rate of the driven joints at the start in 1/s; None if unknown."""
    from robsim.analysis.linearisation.drive_derivatives import DriveDerivatives
    from robsim.analysis.linearisation.linear_plant import DrivePlant

    case = analysis.case
    q = move_runs_last(np.array(case.start), 1)
    try:
        derivatives = DriveDerivatives.of(case, analysis.controller.columns, q)
        plant = DrivePlant.observe(derivatives.map_over, derivatives.output, case.dt)
    except InputError:  # a drive without derivatives
        return None
    radius = float(np.abs(np.linalg.eigvals(plant.whole.of_state)).max())
    return math.log(radius) / case.dt


def report_drive_gain(analysis: RunAnalysis) -> Finding | None:
    """Report a gain above the largest stable gain of the loop with its drives."""
    if analysis.loop.driven is None or not math.isfinite(analysis.gain):
        return None
    factor = find_largest_drive_factor(analysis)
    if factor is None or not 0.0 < factor < 1.0:
        return None
    largest, label = factor * analysis.gain, analysis.loop.driven.drive.label
    sentence = (
        f"The gain of {format_number(analysis.gain)} per second is too high for {label}: near the "
        f"goal the loop is stable below {format_number(largest)} per second"
    )
    evidence = {"gain": analysis.gain, "largest_gain": largest}
    case = scale_gain(analysis.extended_case, STABLE_SHARE * factor)
    trial = None if case is None else analysis.trial(lambda _: case)
    if trial is not None and trial.converged:
        evidence["converges_after_s"] = trial.end_time
        sentence += (
            f"; with {format_number(STABLE_SHARE * largest)} per second the same run {trial.clause}"
        )
    return Finding("gain", f"{sentence}.", evidence)


def find_largest_drive_factor(analysis: RunAnalysis) -> float | None:
    """Return the largest stable factor of the gains with drives; None if it is unknown."""
    from robsim.analysis.linearisation.linear_loop import LinearLoop
    from robsim.analysis.linearisation.stability_limit import find_loop_limit

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)
            return find_loop_limit(LinearLoop.of(analysis.case))
    except InputError:  # a task without a linear loop
        return None


def report_friction(analysis: RunAnalysis) -> Finding | None:
    """Report friction at which the joints rest, if the run without it ends nearer to the goal."""
    joints, outcome = analysis.loop.driven, analysis.outcome
    if joints is None or outcome not in (Outcome.TIME_LIMIT, Outcome.LOCAL_MINIMUM):
        return None
    resting = list_resting_joints(analysis, joints)
    trial = analysis.trial(remove_friction) if resting else None
    if trial is None or trial.converged:
        return None
    recorder, goal = trial.loop.recorder, trial.loop.controller.s_goal.T[0]
    error = float(np.abs(recorder.last.s[0, 0] - goal).max())
    if not error < NEARER * analysis.errors[-1]:
        return None
    sentence = (
        f"Friction holds {format_list(resting)} at rest. Without friction the largest error "
        f"{trial.end} is {analysis.size(error)}."
    )
    return Finding("friction", sentence, {"error_without": error})


def list_resting_joints(analysis: RunAnalysis, joints: DrivenJoints) -> list[str]:
    """Return the names of joints that rest under a torque and friction at the end of a run."""
    last = analysis.history.length - 1
    columns = joints.velocities
    v, torque = (analysis.run[name].values[last, columns] for name in ("qd_actual", "torque"))
    rests = (v == 0.0) & (torque != 0.0) & (joints.numbers("friction") > 0.0)
    return [f"'{name}'" for name, own in zip(joints.names, rests, strict=True) if own]


def report_saturation(analysis: RunAnalysis) -> Finding | None:
    """Report limited torques in a run that converged."""
    joints = analysis.loop.driven
    stated = None if joints is None else describe_saturation(analysis, joints)
    return None if stated is None else Finding("saturation", stated[0], {"saturated": stated[1]})
