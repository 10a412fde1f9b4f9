"""Advice: changes of gain, L, law or image with which the same run converges."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from robsim.analysis.explanation import counterfactuals
from robsim.analysis.explanation.ablation import run_trial
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length, format_number
from robsim.analysis.task_tree import has_robust_weighting, list_servo_tasks
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.servo.laws.inverse import INVERSES
from robsim.servo.laws.law import LAWS
from robsim.servo.shaping.redundancy import AvoidLimits
from robsim.servo.tasks.docking_task import Docking
from robsim.servo.tasks.schemes import IBVS, PBVS
from robsim.servo.tasks.task import ServoTask

MOST_REMEDIES = 3  # pieces of advice
LOWER_GAINS = {0.5: "half", 0.25: "a quarter of", 0.1: "a tenth of"}  # factors of the gain
HIGHER_GAINS = {2.0: "twice", 4.0: "four times", 10.0: "ten times"}
OVERSHOOT = 1.0  # gain times period above which the loop overshoots

Proposal = tuple[str, str, Experiment | None]  # what it is about, with what, and the case
ProposalSource = Callable[[RunAnalysis], Iterator[Proposal]]
NEAR_SHARE = 0.5  # share of the distance without robust weights below which they are advised


def find_remedies(inquiry: RunAnalysis) -> list[Finding]:
    """Return the first few changes with which the run converges, or stays nearer its goal."""
    found = list(propose_robust_weighting(inquiry)) if inquiry.outcome is Outcome.TIME_LIMIT else []
    for remedy in _REMEDIES[inquiry.outcome]:
        for about, how, case in remedy(inquiry):
            trial = run_trial(case) if case is not None and len(found) < MOST_REMEDIES else None
            if trial is not None and trial.converged:
                sentence = f"{how} the same start {trial.ending}."
                evidence = {"converges_after_s": trial.end_time}
                found.append(Finding(about, sentence, evidence))
                if remedy in (propose_lower_gain, propose_higher_gain):
                    break
    return found


def propose_interaction(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with each other named choice of L."""
    given = [leaf.interaction for leaf in list_servo_tasks(inquiry.case.task)]
    used = {which if isinstance(which, str) else "" for which in given}
    if len(used) != 1:
        return
    for which in ("mean", "desired", "current"):
        if which not in used:
            case = counterfactuals.replace_task_fields(inquiry.patient, interaction=which)
            yield "interaction", f"With L {which}", case


def propose_law(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with the other law."""
    servo = inquiry.servo
    used = LAWS.name_of(servo.law) if servo else None
    for which in {"joint", "camera"} - {used} if used in ("joint", "camera") else ():
        case = counterfactuals.replace_task_fields(
            inquiry.case if inquiry.falls else inquiry.patient, law=which
        )
        yield "law", f"With law '{which}'", case


def propose_scheme(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with image-based instead of position-based servoing, or vice versa.

    For a unicycle, docking is yielded as well.
    """
    task = inquiry.case.task
    others: dict[type, tuple[type[ServoTask], ...]] = {IBVS: (PBVS, Docking), PBVS: (IBVS, Docking)}
    kept = ("goal", "camera", "target", "gain", "belief", "joints")
    for other in others.get(type(task), ()):
        given = {name: getattr(task, name) for name in kept}
        with suppress(InputError):  # of a goal, say, that this scheme cannot have
            case = inquiry.patient.with_(task=other(**given))
            yield other.__name__, f"With {other.__name__}", case


def propose_inverse(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with a damped inverse in a singularity, else with a pseudo-inverse."""
    used = INVERSES.name_of(inquiry.servo.inverse) if inquiry.servo else None
    other = "damped" if inquiry.outcome is Outcome.SINGULAR else "pseudo_inverse"
    if used and used != other:
        case = counterfactuals.replace_task_fields(inquiry.patient, inverse=other)
        yield "inverse", f"With inverse='{other}'", case


def propose_no_speed_limit(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case without its speed limit."""
    if any(leaf.limit for leaf in list_servo_tasks(inquiry.case.task)):
        case = counterfactuals.replace_task_fields(inquiry.case, limit=None)
        yield "limit", "Without its speed limit", case


def propose_lower_gain(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with half, a quarter and a tenth of the gain, unless time is short."""
    if not (inquiry.outcome is Outcome.TIME_LIMIT and inquiry.falls):
        for factor, word in LOWER_GAINS.items():
            yield _propose_gain(inquiry, inquiry.patient, factor, word)


def propose_higher_gain(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with two, four and ten times the gain, in the same time."""
    for factor, word in HIGHER_GAINS.items():
        if factor * inquiry.gain * inquiry.case.dt < OVERSHOOT:
            yield _propose_gain(inquiry, inquiry.case, factor, word)


def _propose_gain(inquiry: RunAnalysis, case: Experiment, factor: float, word: str) -> Proposal:
    how = f"With {word} the gain ({format_number(factor * inquiry.gain)} per second)"
    return "gain", how, counterfactuals.scale_gain(case, factor)


def propose_larger_image(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with a larger image."""
    case = counterfactuals.enlarge_images(inquiry.patient)
    yield "image", "With an image twice as wide and high", case


def propose_border_weighting(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case in which marks may leave the image, unless they may already."""
    if not inquiry.controller.excused:
        case = counterfactuals.replace_task_fields(inquiry.patient, weighting="border")
        yield "weighting", "With weighting='border'", case


def propose_limit_avoidance(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with limit avoidance, if the robot is redundant."""
    controller = inquiry.controller
    if controller.columns.size > controller.full_rank:
        case = counterfactuals.replace_task_fields(inquiry.patient, secondary=AvoidLimits())
        yield "secondary", "With secondary=AvoidLimits()", case


def propose_more_time(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with more time, if the error still falls."""
    if inquiry.falls:
        yield "duration", "Given more time", inquiry.patient


def propose_feed_forward(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with feed-forward, if something moves on its own."""
    if not inquiry.case.scene.motions:
        return
    for which in ("known", "estimated"):
        case = counterfactuals.replace_task_fields(inquiry.case, feed_forward=which)
        yield "feed_forward", f"With feed_forward='{which}'", case


def propose_tolerance(inquiry: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with a tolerance above the final error."""
    if inquiry.falls:
        return
    third = inquiry.errors[-max(len(inquiry.errors) // 3, 1) :]
    wanted = float(f"{1.5 * float(np.median(third)):.2g}")
    own = inquiry.controller.tolerances
    if (own == own[0]).all() and inquiry.tolerance < wanted < 0.2 * inquiry.errors[0]:
        case = counterfactuals.replace_task_fields(inquiry.case, tolerance=wanted)
        yield "tolerance", f"With a tolerance of {inquiry.size(wanted)}", case


_REMEDIES: dict[Outcome, tuple[ProposalSource, ...]] = {
    Outcome.RUNNING: (),
    Outcome.ENDED: (),
    Outcome.CONVERGED: (),
    Outcome.LOCAL_MINIMUM: (propose_interaction, propose_law, propose_scheme),
    Outcome.OUT_OF_IMAGE: (
        propose_interaction,
        propose_lower_gain,
        propose_inverse,
        propose_law,
        propose_scheme,
        propose_larger_image,
        propose_border_weighting,
    ),
    Outcome.BEHIND_CAMERA: (
        propose_interaction,
        propose_lower_gain,
        propose_inverse,
        propose_law,
        propose_scheme,
        propose_border_weighting,
    ),
    Outcome.JOINT_LIMIT: (
        propose_limit_avoidance,
        propose_interaction,
        propose_law,
        propose_scheme,
        propose_lower_gain,
    ),
    Outcome.SINGULAR: (propose_interaction, propose_inverse, propose_law, propose_scheme),
    Outcome.DIVERGED: (
        propose_lower_gain,
        propose_inverse,
        propose_interaction,
        propose_law,
        propose_scheme,
    ),
    Outcome.NOT_FINITE: (propose_lower_gain, propose_inverse, propose_interaction, propose_law),
    Outcome.TIME_LIMIT: (
        *(propose_feed_forward, propose_no_speed_limit, propose_inverse, propose_higher_gain),
        *(propose_more_time, propose_lower_gain, propose_law, propose_tolerance),
    ),
}


def propose_robust_weighting(inquiry: RunAnalysis) -> Iterator[Finding]:
    """Yield the advice to weigh robustly, if marks lie, none is weighed so, and it helps.

    It helps if the run converges then. Where noise lets no run converge, it helps if the mean
    distance to the goal over the second half is less than half of what it was.
    """
    q: list[Array] = []
    case = (
        counterfactuals.add_robust_weighting(inquiry.case) if _has_outliers(inquiry.case) else None
    )
    trial = run_trial(case, lambda snapshot, _: q.append(snapshot.q)) if case is not None else None
    if trial is None:
        return
    others = any(leaf.weighting for leaf in list_servo_tasks(inquiry.case.task))
    how = f"With weighting='tukey'{' beside what it has' * others}"
    if trial.converged:
        sentence = f"{how} the same start {trial.ending}."
        yield Finding("weighting", sentence, {"converges_after_s": trial.end_time})
        return
    was = _mean_goal_distance(inquiry.loop, [snapshot.q for snapshot in inquiry.snapshots])
    now = _mean_goal_distance(trial.loop, q)
    if trial.outcome is inquiry.outcome and now < NEAR_SHARE * was:
        sentence = (
            f"{how} the same run ends {format_length(now)} off its goal instead of {format_length(was)} (means "
            "over its second half)."
        )
        yield Finding("weighting", sentence, {"off_m": now, "was_off_m": was})


def _has_outliers(case: Experiment) -> bool:
    """Return whether marks lie that nothing weighs robustly."""
    effects = [each.effect for each in case.sensing.acting()]
    strays = any(effect.deviation(True) < effect.deviation(False) for effect in effects)
    return strays and not has_robust_weighting(case.task)


def _mean_goal_distance(loop: Loop, q: Sequence[Array]) -> float:
    """Return the mean distance (m) to the goal over the second half of coordinates (nq, 1)."""
    late = np.concatenate(q[len(q) // 2 :], axis=1)
    start = np.repeat(loop.q0, late.shape[1], axis=0)
    return float(end_variables.measure_goal_offset(loop.controller, late, start)[1].mean())
