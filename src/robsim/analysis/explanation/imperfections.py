"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.own_motion import own_motions
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.run_facts import RepeatedFacts
from robsim.analysis.explanation.safeties import safeties
from robsim.analysis.explanation.wrong_depths import wrong_depths
from robsim.analysis.repeated import Repeated
from robsim.run.experiment import Experiment
from robsim.world.imperfections.acting import Acting


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
        sentence, evidence = each.effect.stated(RepeatedFacts(again))

        def removed(case: Experiment, each: Acting[Any] = each) -> Experiment:
            return case.with_(**{part: each.removed(getattr(case, part))})

        yield Removal(each.field, each.effect.title, sentence, removed, evidence)
