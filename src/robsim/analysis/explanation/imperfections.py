"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.own_motion import own_motions
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.safeties import safeties
from robsim.analysis.explanation.wrong_depths import wrong_depths
from robsim.analysis.leaves import weighs_robustly
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.world.imperfections.imperfection import Acting, RunFacts


def imperfections(inquiry: Inquiry) -> list[Removal]:
    """Return every imperfection of a run, in the order in which they are removed."""
    return [
        *_acting("sensing", inquiry),
        *_acting("actuation", inquiry),
        *safeties(inquiry.again),
        *wrong_depths(inquiry),
        *false_beliefs(inquiry.case),
        *own_motions(inquiry),
    ]


def _acting(part: str, inquiry: Inquiry) -> Iterator[Removal]:
    """Yield the imperfections of the images or the joints."""
    each: Acting[Any]
    for each in getattr(inquiry.case, part).acting():
        sentence, evidence = each.effect.stated(_facts(inquiry))

        def removed(case: Experiment, each: Acting[Any] = each) -> Experiment:
            return case.with_(**{part: each.removed(getattr(case, part))})

        yield Removal(each.field, each.effect.title, sentence, removed, evidence)


def _facts(inquiry: Inquiry) -> RunFacts:
    """Return the facts of a run from which imperfections state their part in it."""
    case, run = inquiry.case, inquiry.again.run
    qd = run["qd"].values[: max(len(inquiry.snapshots) - 1, 1)]
    moved = run["qd_actual"].values[: len(qd)] if "qd_actual" in run else qd
    task = inquiry.gain, weighs_robustly(case.task), inquiry.controller.columns
    if inquiry.outcome is not Outcome.TIME_LIMIT:
        return RunFacts(case.dt, *task, qd, moved, "", {})
    sizes, tolerance = inquiry.errors, inquiry.tolerance
    floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
    clause = (
        f": the largest error stays at about {inquiry.size(floor)}, and the tolerance is "
        f"{inquiry.size(tolerance)}"
    )
    return RunFacts(case.dt, *task, qd, moved, clause, {"floor": floor, "tolerance": tolerance})
