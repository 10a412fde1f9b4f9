"""Advice where marks lie: robust weights, with which the run converges or stays nearer its goal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robsim.analysis.explanation import changes
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import tried
from robsim.analysis.explanation.wording import length
from robsim.analysis.leaves import leaves, weighs_robustly
from robsim.base.arrays import Array
from robsim.engine.loop import Loop
from robsim.run import ends
from robsim.run.experiment import Experiment

NEARER = 0.5  # share of the distance without robust weights below which they are advised


def robustly(inquiry: Inquiry) -> Iterator[Finding]:
    """Yield the advice to weigh robustly, if marks lie, none is weighed so, and it helps.

    It helps if the run converges then. Where noise lets no run converge, it helps if the mean
    distance to the goal over the second half is less than half of what it was.
    """
    again, q = inquiry.again, list[Array]()
    case = changes.weighed_robustly(inquiry.case) if _lie(inquiry.case) else None
    trial = tried(case, lambda snapshot, _: q.append(snapshot.q)) if case is not None else None
    if trial is None:
        return
    others = any(leaf.weighting for leaf in leaves(inquiry.case.task))
    how = f"With weighting='tukey'{' beside what it has' * others}"
    if trial.converged:
        sentence = f"{how} the same start {trial.ending}."
        yield Finding("weighting", sentence, {"converges_after_s": trial.end_time})
        return
    was = _distance(again.loop, [snapshot.q for snapshot in again.snapshots])
    now = _distance(trial.loop, q)
    if trial.outcome is inquiry.outcome and now < NEARER * was:
        sentence = (
            f"{how} the same run ends {length(now)} off its goal instead of {length(was)} (means "
            "over its second half)."
        )
        yield Finding("weighting", sentence, {"off_m": now, "was_off_m": was})


def _lie(case: Experiment) -> bool:
    """Return whether marks lie that nothing weighs robustly."""
    effects = [each.effect for each in case.sensing.acting()]
    strays = any(effect.deviation(True) < effect.deviation(False) for effect in effects)
    return strays and not weighs_robustly(case.task)


def _distance(loop: Loop, q: Sequence[Array]) -> float:
    """Return the mean distance (m) to the goal over the second half of coordinates (nq, 1)."""
    late = np.concatenate(q[len(q) // 2 :], axis=1)
    start = np.repeat(loop.q0, late.shape[1], axis=0)
    return float(ends.off_goal(loop.controller, late, start)[1].mean())
