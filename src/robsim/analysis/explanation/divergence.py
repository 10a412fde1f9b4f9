"""Causes of a growing error: the gain, the interaction matrix, or values that are not finite."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.outcome_sentences import name_not_finite
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_number, format_quantity

ROUNDING = 1e-9  # rounding of a contraction; a limit cycle has 1


def report_loop_gain(analysis: RunAnalysis) -> Finding | None:
    """Report a gain that is too high for the control period."""
    radius = analysis.measures["contraction"]
    motion = analysis.measures["stability_motion"]
    product = analysis.gain * analysis.case.dt
    known = np.isfinite(radius)
    ideal = abs(1 - product)  # if Lhat = L
    value = float(np.median(radius[known])) if known.any() else ideal
    decreases = known.any() and np.median(motion[known]) > 0
    if not (value > 1 - ROUNDING and (decreases or product > 2)):
        return None
    depends_on_L = decreases and value > 1.1 * ideal  # this Lhat determines the limit
    value = max(value, ideal)
    limit = 2 * product / (1 + value) if depends_on_L else 2.0
    sentence = (
        f"The gain is too high for the period of {format_number(1000 * analysis.case.dt)} ms: "
        f"gain times period is {format_number(product)}, and "
        f"after one period an error can be {format_number(value)} times as large as before; "
        + ("with this inverse and this L it" if depends_on_L else "a loop without delay")
        + f" is stable below {'about ' * bool(depends_on_L)}{format_number(limit)}."
    )
    return Finding("gain", sentence, {"gain_dt": product, "contraction": value, "limit": limit})


def report_wrong_interaction(analysis: RunAnalysis) -> Finding | None:
    """Report an Lhat so far from L that some motions lead away from the goal."""
    radius = analysis.measures["contraction"]
    motion = analysis.measures["stability_motion"]
    known = np.isfinite(motion)
    if not known.any() or not (motion[known] < -1e-9).any():
        return None
    least = float(motion[known].min())
    if np.median(radius[known]) <= 1:
        return None
    sentence = (
        "The L J that the law uses is too far from the true one: the symmetric part of "
        f"(Lhat J)^+ L J has an eigenvalue of {format_number(least)}, so that some motions "
        "lead away from the goal."
    )
    return Finding("wrong interaction matrix", sentence, {"least_eigenvalue": least})


def report_growing_error(analysis: RunAnalysis) -> Finding | None:
    """Report an error that grew during the run."""
    V = analysis.measures["lyapunov"]
    if not np.isfinite(V).all() or V[-1] <= 1.05 * V[0]:
        return None
    unit = analysis.run["lyapunov"].attrs["units"].removesuffix("^2")
    unit = "1" if "see" in unit else unit  # several features
    first, last = (format_quantity(float(np.sqrt(2 * each)), unit) for each in (V[0], V[-1]))
    sentence = f"The error did not shrink: its norm grew from {first} to {last}."
    return Finding("growing error", sentence, {"from": float(V[0]), "to": float(V[-1])})


def report_not_finite(analysis: RunAnalysis) -> Finding | None:
    """Report the features, the law or the state that is not finite."""
    servo = analysis.servo
    quantity = name_not_finite(analysis)
    if servo is None:
        return None
    if quantity == "a feature":
        sentence = f"{servo.bound_features.names} gave a number that is not finite at this view"
        return Finding("feature", f"{sentence}{servo.bound_features.reasons}.")
    if quantity == "the command":
        sentence = (
            f"{type(servo.law).__name__} gave a command that is not finite, from finite features."
        )
        return Finding("law", sentence)
    return Finding("state", "The command was so large that a coordinate overflowed.")
