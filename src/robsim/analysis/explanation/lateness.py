"""Reasons why an error was not small in time: slow decay, or a stationary error."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.stalls import too_few
from robsim.analysis.explanation.wording import number
from robsim.analysis.leaves import leaves

SLOWED = 0.7  # share of the gain below which the decay counts as slowed down


def slow(inquiry: Inquiry) -> Finding | None:
    """Report an error that still falls when the time is over."""
    if not inquiry.on_its_way:
        return None
    rate, arrival, gain = inquiry.decay, inquiry.arrival, inquiry.gain
    trial = inquiry.trial(lambda case: case)
    if trial is not None and trial.converged:
        late = f"given more time it {trial.ending}"
    else:
        late = f"at that rate it is below the tolerance after {number(arrival)} s"
    known = f", with a gain of {number(gain)} per second" if np.isfinite(gain) else ""
    sentence = (
        f"It was still on its way: the error falls at {number(rate)} per second{known}, and {late}."
    )
    if rate < SLOWED * gain and any(leaf.limit for leaf in leaves(inquiry.case.task)):
        sentence += " The speed limit of the task slows the command down."
    evidence = {"rate": rate, "arrival_s": arrival} | ({"gain": gain} if known else {})
    return Finding("too little time", sentence, evidence)


def lagging(inquiry: Inquiry) -> Finding | None:
    """Report an error that does not fall any more."""
    if inquiry.on_its_way:
        return None
    low, high = float(inquiry.late_errors.min()), float(inquiry.late_errors.max())
    sentence = (
        f"In the last third of its time the error stays between {inquiry.size(low)} and "
        f"{inquiry.size(high)}: what the law commands does not make it smaller any more."
        f"{too_few(inquiry)}"
    )
    return Finding("standing error", sentence, {"low": low, "high": high})
