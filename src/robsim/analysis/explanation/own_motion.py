"""Motions of other robots, and a law that does not compensate for them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.wording import listed, movers, number
from robsim.analysis.leaves import leaves
from robsim.analysis.truth import true_features
from robsim.run.experiment import Experiment
from robsim.world.motion import Motion


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
