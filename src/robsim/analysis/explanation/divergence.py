"""Reasons why an error grew: the gain, the interaction matrix, or values that are not finite."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.outcome_sentences import name_not_finite
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_number

ROUNDING = 1e-9  # of a contraction: that of a limit cycle is 1 but for it


def report_loop_gain(inquiry: RunAnalysis) -> Finding | None:
    """Report a gain that is too high for the control period."""
    radius = inquiry.diagnosis["contraction"].values
    motion = inquiry.diagnosis["stability_motion"].values
    product = inquiry.gain * inquiry.case.dt
    known = np.isfinite(radius)
    ideal = abs(1 - product)  # if Lhat = L
    value = float(np.median(radius[known])) if known.any() else ideal
    shrinks = known.any() and np.median(motion[known]) > 0
    if not (value > 1 - ROUNDING and (shrinks or product > 2)):
        return None
    own = shrinks and value > 1.1 * ideal  # the limit is that of this Lhat
    value = max(value, ideal)
    limit = 2 * product / (1 + value) if own else 2.0
    sentence = (
        f"The gain is too high for the period: gain times period is {format_number(product)}, and what "
        f"is left of an error after one period is up to {format_number(value)} times what there was; "
        + ("with this inverse and this L it" if own else "a loop without delay")
        + f" is stable below {'about ' * bool(own)}{format_number(limit)}."
    )
    return Finding("gain", sentence, {"gain_dt": product, "contraction": value, "limit": limit})


def report_wrong_interaction(inquiry: RunAnalysis) -> Finding | None:
    """Report an Lhat too far from L, by which some motions lead away from the goal."""
    radius = inquiry.diagnosis["contraction"].values
    motion = inquiry.diagnosis["stability_motion"].values
    known = np.isfinite(motion)
    if not known.any() or not (motion[known] < -1e-9).any():
        return None
    least = float(motion[known].min())
    if np.median(radius[known]) <= 1:
        return None
    sentence = (
        "What the law takes for L J is too far from the truth: the symmetric part of "
        f"(Lhat J)^+ L J has an eigenvalue of {format_number(least)}, so that some motions lead away from "
        "the goal."
    )
    return Finding("wrong interaction matrix", sentence, {"least_eigenvalue": least})


def report_growing_error(inquiry: RunAnalysis) -> Finding | None:
    """Report an error that grew during the run."""
    V = inquiry.diagnosis["lyapunov"].values
    if not np.isfinite(V).all() or V[-1] <= 1.05 * V[0]:
        return None
    sentence = (
        f"The error did not shrink: V grew from {inquiry.with_unit('lyapunov', 0)} to "
        f"{inquiry.with_unit('lyapunov')}."
    )
    return Finding("growing error", sentence, {"from": float(V[0]), "to": float(V[-1])})


def report_not_finite(inquiry: RunAnalysis) -> Finding | None:
    """Report the features, the law or the state that is not finite."""
    servo = inquiry.servo
    what = name_not_finite(inquiry)
    if servo is None:
        return None
    if what == "a feature":
        sentence = f"{servo.regulated.names} gave a number that is not finite at this view"
        return Finding("feature", f"{sentence}{servo.regulated.reasons}.")
    if what == "the command":
        sentence = f"{type(servo.law).__name__} commanded what is not finite, from finite features."
        return Finding("law", sentence)
    return Finding("state", "The command was so large that a coordinate overflowed.")
