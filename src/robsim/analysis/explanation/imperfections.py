"""The imperfections of a run: in images, joints, depths and beliefs, and prescribed motions."""

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


def list_imperfections(analysis: RunAnalysis) -> list[Ablation]:
    """Return every imperfection of a run, in the order of their removal."""
    return [
        *_list_acting_effects("sensing", analysis),
        *_list_acting_effects("actuation", analysis),
        *_list_drive_imperfections(analysis),
        *list_safety_limits(analysis),
        *list_depth_errors(analysis),
        *find_false_beliefs(analysis.case),
        *list_own_motions(analysis),
    ]


def _list_drive_imperfections(analysis: RunAnalysis) -> list[Ablation]:
    """Return the imperfections of driven joints."""
    if analysis.loop.driven is None:
        return []
    from robsim.analysis.explanation.drive_imperfections import list_drive_imperfections

    return list(list_drive_imperfections(analysis))


def _list_acting_effects(part: str, analysis: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfections of the images or the joints."""
    each: ActiveImperfection[Any]
    for each in getattr(analysis.case, part).list_active():
        sentence, evidence = each.effect.stated(_make_run_facts(analysis))

        def remove(case: Experiment, each: ActiveImperfection[Any] = each) -> Experiment:
            return case.with_(**{part: each.remove_from(getattr(case, part))})

        yield Ablation(each.field, each.effect.title, sentence, remove, evidence)


def _make_run_facts(analysis: RunAnalysis) -> RunFacts:
    """Return the facts of a run that imperfections need for their statements."""
    case, run = analysis.case, analysis.run
    qd = run["qd"].values[: max(analysis.history.length - 1, 1)]
    velocities = run["qd_actual"].values[: len(qd)] if "qd_actual" in run else qd
    task = analysis.gain, has_robust_weighting(case.task), analysis.controller.columns
    if analysis.outcome is not Outcome.TIME_LIMIT:
        return RunFacts(case.dt, *task, qd, velocities, "", {})
    sizes, tolerance = analysis.errors, analysis.tolerance
    floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
    clause = (
        f": the largest error stays at about {analysis.size(floor)}, and the tolerance is "
        f"{analysis.size(tolerance)}"
    )
    return RunFacts(
        case.dt, *task, qd, velocities, clause, {"floor": floor, "tolerance": tolerance}
    )


def list_own_motions(analysis: RunAnalysis) -> Iterator[Ablation]:
    """Yield the prescribed motions of robots as one imperfection; its removal stops them all."""
    scene = analysis.case.scene
    if not scene.motions:
        return
    names = format_list([f"'{motion.robot}'" for motion in scene.motions])
    drift, gain = _largest_drift(analysis), analysis.gain
    has_feed_forward = any(
        leaf.feed_forward is not None for leaf in list_servo_tasks(analysis.case.task)
    )
    how = (
        "and its feed-forward does not compensate"
        if has_feed_forward
        else "and the law has no feed-forward"
    )
    sentence = f"{format_moving_robots(scene)}, {how}"
    if np.isfinite(drift / gain):
        sentence += (
            f": a law of gain {format_number(gain)} per second lags behind by about the drift "
            f"of the error over the gain, {format_number(drift)} / {format_number(gain)} = "
            f"{analysis.size(drift / gain)}"
        )
    stopped_motions = [Motion(m.robot, np.zeros(scene.robot(m.robot).nv)) for m in scene.motions]
    evidence = {"drift": drift, "gain": gain, "lag": drift / gain}

    def stop_motions(case: Experiment) -> Experiment:
        return case.with_(scene=case.scene.replacing(*stopped_motions))

    undone = f"with {names} standing still"
    name = "the prescribed motion"
    yield Ablation("own motion", name, f"{sentence}.", stop_motions, evidence, undone)


def _largest_drift(analysis: RunAnalysis) -> float:
    """Return the largest rate of the error due to prescribed motions at the end, in 1/s."""
    case = analysis.case
    truth = compute_true_error(case.task, case.scene, analysis.last_state.q)
    if truth is None:
        return float("nan")
    return float(np.abs(truth.rates[0] @ case.scene.drift(analysis.end)).max())
