"""Motions of other robots, and a law that does not compensate for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation import views
from robsim.analysis.explanation.removal import Removal
from robsim.analysis.explanation.wording import listed, movers, number
from robsim.analysis.leaves import leaves
from robsim.analysis.repeated import Repeated
from robsim.analysis.truth import true_features
from robsim.world.motion import Motion


def own_motions(again: Repeated) -> Iterator[Removal]:
    """Yield the imperfection that robots move on their own, removed by stopping all."""
    scene = again.case.scene
    if not scene.motions:
        return
    names = listed([f"'{motion.robot}'" for motion in scene.motions])
    drift, gain = _drift(again), views.gain_of(again.case)
    known = any(leaf.feed_forward is not None for leaf in leaves(again.case.task))
    how = "and its feed-forward does not make up for it" if known else "and the law does not know"
    sentence = f"{movers(scene)}, {how}"
    if np.isfinite(drift / gain):
        sentence += (
            f": a law of gain {number(gain)} per second lags behind by about the drift of the "
            f"error over the gain, {number(drift)} / {number(gain)} = "
            f"{views.size(again, drift / gain)}"
        )
    still = [Motion(m.robot, np.zeros(scene.robot(m.robot).nv)) for m in scene.motions]
    evidence = {"drift": drift, "gain": gain, "lag": drift / gain}
    undone = f"with {names} standing still"
    yield Removal(
        "own motion", "what moves on its own", f"{sentence}.", _stands(still), evidence, undone
    )


def _stands(still: list[Motion]) -> Any:
    return lambda case: case.with_(scene=case.scene.replacing(*still))


def _drift(again: Repeated) -> float:
    """Return the largest rate of change of the error by own motions at the end, per second."""
    case, last = again.case, len(again.snapshots) - 1
    truth = true_features(case.task, case.scene, again.snapshots[last].q)
    if truth is None:
        return float("nan")
    own = case.scene.drift(last * case.dt)
    return float(np.abs(truth.rates[0] @ own).max())
