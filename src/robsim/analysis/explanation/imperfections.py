"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.safeties import safeties
from robsim.analysis.explanation.wording import listed, movers, number
from robsim.analysis.explanation.wrong_depths import wrong_depths
from robsim.analysis.leaves import leaves, weighs_robustly
from robsim.analysis.truth import true_features
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.world.imperfections.imperfection import Acting, RunFacts
from robsim.world.motion import Motion


def imperfections(inquiry: Inquiry) -> list[Removal]:
    """Return every imperfection of a run, in the order in which they are removed."""
    return [
        *_acting("sensing", inquiry),
        *_acting("actuation", inquiry),
        *safeties(inquiry),
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
    case, run = inquiry.case, inquiry.run
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


def own_motions(inquiry: Inquiry) -> Iterator[Removal]:
    """Yield the imperfection that robots move on their own, removed by stopping all."""
    scene = inquiry.case.scene
    if not scene.motions:
        return
    names = listed([f"'{motion.robot}'" for motion in scene.motions])
    drift, gain = _drift(inquiry), inquiry.gain
    known = any(leaf.feed_forward is not None for leaf in leaves(inquiry.case.task))
    how = "and its feed-forward does not make up for it" if known else "and the law does not know"
    sentence = f"{movers(scene)}, {how}"
    if np.isfinite(drift / gain):
        sentence += (
            f": a law of gain {number(gain)} per second lags behind by about the drift of the "
            f"error over the gain, {number(drift)} / {number(gain)} = "
            f"{inquiry.size(drift / gain)}"
        )
    still = [Motion(m.robot, np.zeros(scene.robot(m.robot).nv)) for m in scene.motions]
    evidence = {"drift": drift, "gain": gain, "lag": drift / gain}

    def stopped(case: Experiment) -> Experiment:
        return case.with_(scene=case.scene.replacing(*still))

    told = f"{sentence}.", stopped, evidence, f"with {names} standing still"
    yield Removal("own motion", "what moves on its own", *told)


def _drift(inquiry: Inquiry) -> float:
    """Return the largest rate of change of the error by own motions at the end, per second."""
    case = inquiry.case
    truth = true_features(case.task, case.scene, inquiry.snapshots[-1].q)
    if truth is None:
        return float("nan")
    return float(np.abs(truth.rates[0] @ case.scene.drift(inquiry.end)).max())
