"""Why an error was not small in time: too slow, or standing."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation import views
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import number


def slow(inquiry: Inquiry) -> Finding | None:
    """An error that falls, but has not had the time."""
    rate, arrival = inquiry.decay, inquiry.arrival
    if not inquiry.falls or not np.isfinite(arrival):
        return None
    gain = views.gain_of(inquiry.case)
    trial = inquiry.trial(lambda case: case)
    late = ""
    if trial is not None and trial.converged:
        late = f"; given more time it is there after {number(trial.end_time)} s"
    sentence = (
        f"It was still on its way: the error falls at {number(rate)} per second, with a gain of "
        f"{number(gain)} per second, and at that rate it is below the tolerance after "
        f"{number(arrival)} s{late}."
    )
    evidence = {"rate": rate, "gain": gain, "arrival_s": arrival}
    return Finding("too little time", sentence, evidence)


def lagging(inquiry: Inquiry) -> Finding | None:
    """An error that stays."""
    if slow(inquiry):
        return None
    third = inquiry.errors[-max(len(inquiry.errors) // 3, 3) :]
    low, high = float(third.min()), float(third.max())
    rate = inquiry.value("lyapunov_rate")
    sentence = (
        f"The error stays between {inquiry.size(low)} and {inquiry.size(high)}, and V' is "
        f"{number(rate)} at the end: what the law commands does not make it smaller."
    )
    return Finding("standing error", sentence, {"low": low, "high": high})
