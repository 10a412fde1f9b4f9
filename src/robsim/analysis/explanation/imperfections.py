"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation import views
from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.own_motion import own_motions
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.safeties import safeties
from robsim.analysis.explanation.wrong_depths import wrong_depths
from robsim.analysis.leaves import weighs_robustly
from robsim.analysis.repeated import Repeated
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.world.imperfections.imperfection import Acting, RunFacts


def imperfections(again: Repeated) -> list[Removal]:
    """Return every imperfection of a run, in the order in which they are removed."""
    return [
        *_acting("sensing", again),
        *_acting("actuation", again),
        *safeties(again),
        *wrong_depths(again),
        *false_beliefs(again.case),
        *own_motions(again),
    ]


def _acting(part: str, again: Repeated) -> Iterator[Removal]:
    """Yield the imperfections of the images or the joints."""
    each: Acting[Any]
    for each in getattr(again.case, part).acting():
        sentence, evidence = each.effect.stated(_facts(again))

        def removed(case: Experiment, each: Acting[Any] = each) -> Experiment:
            return case.with_(**{part: each.removed(getattr(case, part))})

        yield Removal(each.field, each.effect.title, sentence, removed, evidence)


def _facts(again: Repeated) -> RunFacts:
    """Return the facts of a run from which imperfections state their part in it."""
    case, controller, run = again.case, again.loop.controller, again.run
    qd = run["qd"].values[: max(len(again.snapshots) - 1, 1)]
    moved = run["qd_actual"].values[: len(qd)] if "qd_actual" in run else qd
    task = views.gain_of(case), weighs_robustly(case.task), controller.columns
    if again.outcome is not Outcome.TIME_LIMIT:
        return RunFacts(case.dt, *task, qd, moved, "", {})
    sizes, tolerance = views.largest_errors(again), controller.tolerance
    floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
    clause = (
        f": the largest error stays at about {views.size(again, floor)}, and the tolerance is "
        f"{views.size(again, tolerance)}"
    )
    return RunFacts(case.dt, *task, qd, moved, clause, {"floor": floor, "tolerance": tolerance})
