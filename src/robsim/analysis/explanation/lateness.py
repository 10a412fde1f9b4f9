"""Why an error was not small in time: too slow, or standing."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation import views
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import number
from robsim.analysis.leaves import leaves

SLOWED = 0.7  # of the gain: an error that falls less fast is slowed down


def slow(inquiry: Inquiry) -> Finding | None:
    """An error that falls, but has not had the time."""
    rate, arrival = inquiry.decay, inquiry.arrival
    if not inquiry.falls or not np.isfinite(arrival):
        return None
    gain = views.gain_of(inquiry.case)
    trial = inquiry.trial(lambda case: case)
    if trial is not None and trial.converged:
        late = f"given more time it {trial.told}"
    else:
        late = f"at that rate it is below the tolerance after {number(arrival)} s"
    sentence = (
        f"It was still on its way: the error falls at {number(rate)} per second, with a gain of "
        f"{number(gain)} per second, and {late}."
    )
    if rate < SLOWED * gain and any(leaf.limit for leaf in leaves(inquiry.case.task)):
        sentence += " The speed limit of the task slows the command down."
    evidence = {"rate": rate, "gain": gain, "arrival_s": arrival}
    return Finding("too little time", sentence, evidence)


def lagging(inquiry: Inquiry) -> Finding | None:
    """An error that stays."""
    if slow(inquiry):
        return None
    third = inquiry.errors[-max(len(inquiry.errors) // 3, 3) :]
    low, high = float(third.min()), float(third.max())
    sentence = (
        f"In the last third of its time the error stays between {inquiry.size(low)} and "
        f"{inquiry.size(high)}: what the law commands does not make it smaller any more."
    )
    return Finding("standing error", sentence, {"low": low, "high": high})
