"""Causes of slow convergence: slow decay, a stationary error, or a car's steering."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.standstill import describe_missing_velocities
from robsim.analysis.explanation.text_format import format_angle, format_length, format_number
from robsim.analysis.task_tree import list_servo_tasks
from robsim.robot.joint import Steering

SLOW_SHARE = 0.7  # share of the gain below which the decay is slow
AT_THE_LIMIT = 0.999  # share of the largest steering angle


def report_slow_decay(analysis: RunAnalysis) -> Finding | None:
    """Report an error that still falls at the end of the time."""
    if not analysis.is_converging:
        return None
    rate, arrival, gain = analysis.decay, analysis.arrival_time, analysis.gain
    trial = analysis.trial(lambda case: case)
    if trial is not None and trial.converged:
        late = f"given more time it {trial.clause}"
    else:
        late = f"at that rate it is below the tolerance after {format_number(arrival)} s"
    known = f", with a gain of {format_number(gain)} per second" if np.isfinite(gain) else ""
    pace = f"{format_number(rate)} per second{known}"
    sentence = f"The error still falls at {pace}, and {late}."
    if rate < SLOW_SHARE * gain and any(
        leaf.limit for leaf in list_servo_tasks(analysis.case.task)
    ):
        sentence += " The speed limit of the task slows the command down."
    evidence = {"rate": rate, "arrival_s": arrival} | ({"gain": gain} if known else {})
    return Finding("too little time", sentence, evidence)


def report_standing_error(analysis: RunAnalysis) -> Finding | None:
    """Report an error that does not fall any more."""
    if analysis.is_converging:
        return None
    low, high = float(analysis.late_errors.min()), float(analysis.late_errors.max())
    sentence = (
        f"In the last third of its time the error stays between {analysis.size(low)} and "
        f"{analysis.size(high)}: the command does not reduce it any more."
        f"{describe_missing_velocities(analysis)}"
    )
    return Finding("standing error", sentence, {"low": low, "high": high})


def report_steering(analysis: RunAnalysis) -> Finding | None:
    """Report a car that is to turn without driving, or beyond its steering limit."""
    last, tree = analysis.last_state, analysis.case.scene.tree
    for row, velocity, steering in tree.cars:
        name = analysis.case.scene.coordinate_names[row]
        speed, turn = (float(rate) for rate in last.qd[velocity : velocity + 2, 0])
        if analysis.is_falling or turn == 0.0:
            continue
        if speed == 0.0:
            return _report_standing_car(name, turn)
        angle = float(np.arctan(steering.wheelbase * turn / speed))
        beyond = abs(angle) > steering.limit * (1 + 1e-9)
        if beyond and last.q[row, 0] * np.sign(angle) > AT_THE_LIMIT * steering.limit:
            return _report_steering_limit(name, steering, abs(angle))
    return None


def _report_standing_car(name: str, turn: float) -> Finding:
    """Report a car that is to turn without driving."""
    sentence = (
        f"The law commands {format_number(turn)} rad/s to a standing car: at any angle of "
        f"'{name}', a car turns only while it drives."
    )
    return Finding("standing car", sentence, {"turn_rad_s": turn})


def _report_steering_limit(name: str, steering: Steering, angle: float) -> Finding:
    """Report a car at its steering limit."""
    radius = steering.wheelbase / float(np.tan(steering.limit))
    sentence = (
        f"'{name}' is at its limit of {format_angle(steering.limit)}, and the law commands "
        f"{format_angle(angle)}: the car drives no circle smaller than {format_length(radius)} in "
        "radius. Let the car turn faster than it approaches, by a larger gain of the turn, or "
        "start farther away."
    )
    evidence = {"limit_rad": steering.limit, "asked_rad": angle, "radius_m": radius}
    return Finding("steering limit", sentence, evidence)
