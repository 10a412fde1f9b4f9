"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation.ablation import Ablation
from robsim.analysis.explanation.belief_differences import find_false_beliefs
from robsim.analysis.explanation.depth_errors import list_depth_errors
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.safety_limits import list_safety_limits
from robsim.analysis.explanation.text_format import format_list, format_moving_robots, format_number
from robsim.analysis.task_tree import has_robust_weighting, list_servo_tasks
from robsim.analysis.true_error import compute_true_error
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.world.imperfections.imperfection import ActiveImperfection, RunFacts
from robsim.world.motion import Motion


def list_imperfections(inquiry: RunAnalysis) -> list[Ablation]:
    """Return every imperfection of a run, in the order in which they are removed."""
    return [
        *_list_acting_effects("sensing", inquiry),
        *_list_acting_effects("actuation", inquiry),
        *list_safety_limits(inquiry),
        *list_depth_errors(inquiry),
        *find_false_beliefs(inquiry.case),
        *list_own_motions(inquiry),
    ]


def _list_acting_effects(part: str, inquiry: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfections of the images or the joints."""
    each: ActiveImperfection[Any]
    for each in getattr(inquiry.case, part).acting():
        sentence, evidence = each.effect.stated(_make_run_facts(inquiry))

        def removed(case: Experiment, each: ActiveImperfection[Any] = each) -> Experiment:
            return case.with_(**{part: each.removed(getattr(case, part))})

        yield Ablation(each.field, each.effect.title, sentence, removed, evidence)


def _make_run_facts(inquiry: RunAnalysis) -> RunFacts:
    """Return the facts of a run from which imperfections state their part in it."""
    case, run = inquiry.case, inquiry.run
    qd = run["qd"].values[: max(len(inquiry.snapshots) - 1, 1)]
    moved = run["qd_actual"].values[: len(qd)] if "qd_actual" in run else qd
    task = inquiry.gain, has_robust_weighting(case.task), inquiry.controller.columns
    if inquiry.outcome is not Outcome.TIME_LIMIT:
        return RunFacts(case.dt, *task, qd, moved, "", {})
    sizes, tolerance = inquiry.errors, inquiry.tolerance
    floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
    clause = (
        f": the largest error stays at about {inquiry.size(floor)}, and the tolerance is "
        f"{inquiry.size(tolerance)}"
    )
    return RunFacts(case.dt, *task, qd, moved, clause, {"floor": floor, "tolerance": tolerance})


def list_own_motions(inquiry: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfection that robots move on their own, removed by stopping all."""
    scene = inquiry.case.scene
    if not scene.motions:
        return
    names = format_list([f"'{motion.robot}'" for motion in scene.motions])
    drift, gain = _largest_drift(inquiry), inquiry.gain
    known = any(leaf.feed_forward is not None for leaf in list_servo_tasks(inquiry.case.task))
    how = "and its feed-forward does not make up for it" if known else "and the law does not know"
    sentence = f"{format_moving_robots(scene)}, {how}"
    if np.isfinite(drift / gain):
        sentence += (
            f": a law of gain {format_number(gain)} per second lags behind by about the drift of the "
            f"error over the gain, {format_number(drift)} / {format_number(gain)} = "
            f"{inquiry.size(drift / gain)}"
        )
    still = [Motion(m.robot, np.zeros(scene.robot(m.robot).nv)) for m in scene.motions]
    evidence = {"drift": drift, "gain": gain, "lag": drift / gain}

    def stopped(case: Experiment) -> Experiment:
        return case.with_(scene=case.scene.replacing(*still))

    told = f"{sentence}.", stopped, evidence, f"with {names} standing still"
    yield Ablation("own motion", "what moves on its own", *told)


def _largest_drift(inquiry: RunAnalysis) -> float:
    """Return the largest rate of change of the error by own motions at the end, per second."""
    case = inquiry.case
    truth = compute_true_error(case.task, case.scene, inquiry.snapshots[-1].q)
    if truth is None:
        return float("nan")
    return float(np.abs(truth.rates[0] @ case.scene.drift(inquiry.end)).max())
