"""Reasons why an error was not small in time: slow decay, a stationary error, a car's steering."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.standstill import describe_missing_velocities
from robsim.analysis.explanation.text_format import format_angle, format_length, format_number
from robsim.analysis.task_tree import list_servo_tasks
from robsim.robot.joint import Steering

SLOW_SHARE = 0.7  # share of the gain below which the decay counts as slowed down
AT_THE_LIMIT = 0.999  # of the largest angle


def report_slow_decay(inquiry: RunAnalysis) -> Finding | None:
    """Report an error that still falls when the time is over."""
    if not inquiry.on_its_way:
        return None
    rate, arrival, gain = inquiry.decay, inquiry.arrival, inquiry.gain
    trial = inquiry.trial(lambda case: case)
    if trial is not None and trial.converged:
        late = f"given more time it {trial.ending}"
    else:
        late = f"at that rate it is below the tolerance after {format_number(arrival)} s"
    known = f", with a gain of {format_number(gain)} per second" if np.isfinite(gain) else ""
    sentence = f"It was still on its way: the error falls at {format_number(rate)} per second{known}, and {late}."
    if rate < SLOW_SHARE * gain and any(leaf.limit for leaf in list_servo_tasks(inquiry.case.task)):
        sentence += " The speed limit of the task slows the command down."
    evidence = {"rate": rate, "arrival_s": arrival} | ({"gain": gain} if known else {})
    return Finding("too little time", sentence, evidence)


def report_standing_error(inquiry: RunAnalysis) -> Finding | None:
    """Report an error that does not fall any more."""
    if inquiry.on_its_way:
        return None
    low, high = float(inquiry.late_errors.min()), float(inquiry.late_errors.max())
    sentence = (
        f"In the last third of its time the error stays between {inquiry.size(low)} and "
        f"{inquiry.size(high)}: what the law commands does not make it smaller any more."
        f"{describe_missing_velocities(inquiry)}"
    )
    return Finding("standing error", sentence, {"low": low, "high": high})


def report_steering(inquiry: RunAnalysis) -> Finding | None:
    """Report a car that is to turn while it stands, or beyond its steering limit."""
    last, tree = inquiry.snapshots[-1], inquiry.case.scene.tree
    for row, velocity, steering in tree.cars:
        name = inquiry.case.scene.coordinate_names[row]
        speed, turn = (float(rate) for rate in last.qd[velocity : velocity + 2, 0])
        if inquiry.falls or turn == 0.0:
            continue
        if speed == 0.0:
            return _report_standing_car(name, turn)
        asked = float(np.arctan(steering.wheelbase * turn / speed))
        beyond = abs(asked) > steering.limit * (1 + 1e-9)
        if beyond and last.q[row, 0] * np.sign(asked) > AT_THE_LIMIT * steering.limit:
            return _report_steering_limit(name, steering, abs(asked))
    return None


def _report_standing_car(name: str, turn: float) -> Finding:
    sentence = (
        f"The law asks for {format_number(turn)} rad/s of a car that stands: however '{name}' is, only a "
        "car that drives can turn."
    )
    return Finding("standing car", sentence, {"turn_rad_s": turn})


def _report_steering_limit(name: str, steering: Steering, asked: float) -> Finding:
    radius = steering.wheelbase / float(np.tan(steering.limit))
    sentence = (
        f"'{name}' is at its limit of {format_angle(steering.limit)}, and the law asks for "
        f"{format_angle(asked)}: the car drives no circle smaller than {format_length(radius)} in radius. Let "
        "the way ahead take longer than the turn, by a larger gain of what turns it, or start "
        "farther away."
    )
    evidence = {"limit_rad": steering.limit, "asked_rad": asked, "radius_m": radius}
    return Finding("steering limit", sentence, evidence)
