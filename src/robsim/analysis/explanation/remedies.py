"""Advice: changes of gain, L, law or image that let the same run converge."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation import counterfactuals
from robsim.analysis.explanation.ablation import AblationTrial, run_trial
from robsim.analysis.explanation.active_constraints import advise_constraints
from robsim.analysis.explanation.deadlocks import advise_via_pose, propose_metric, propose_rollout
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.path_changes import find_path_changes, find_trial_changes
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length, format_number
from robsim.analysis.task_tree import has_robust_weighting, list_servo_tasks
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.features.images.luminance import Luminance
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.servo.laws.constrained_law import ConstrainedLaw
from robsim.servo.laws.inverse import INVERSES
from robsim.servo.laws.law import LAWS
from robsim.servo.shaping.redundancy import AvoidLimits
from robsim.servo.tasks.docking_task import Docking
from robsim.servo.tasks.schemes import IBVS, PBVS
from robsim.servo.tasks.task import ServoTask

MOST_REMEDIES = 3  # most pieces of advice
LOWER_GAINS = {0.5: "half", 0.25: "a quarter of", 0.1: "a tenth of"}  # factors of the gain
HIGHER_GAINS = {2.0: "twice", 4.0: "four times", 10.0: "ten times"}
OVERSHOOT = 1.0  # product of gain and period above which the loop overshoots

Proposal = tuple[str, str, Experiment | None]  # subject, phrase such as "With L mean", case
ProposalSource = Callable[[RunAnalysis], Iterator[Proposal]]
NEAR_SHARE = 0.5  # largest ratio of the distances with and without advised robust weights


def find_remedies(analysis: RunAnalysis) -> list[Finding]:
    """Return the first few changes that let the run converge, or bring it nearer to its goal."""
    advice = (
        list(propose_robust_weighting(analysis)) if analysis.outcome is Outcome.TIME_LIMIT else []
    )
    advice += advise_constraints(analysis)
    for remedy in _REMEDIES[analysis.outcome]:
        for about, how, case in remedy(analysis):
            trial = run_trial(case) if case is not None and len(advice) < MOST_REMEDIES else None
            if case is not None and trial is not None and trial.converged:
                advice.append(report_trial(analysis, about, how, case, trial))
                if remedy in (propose_lower_gain, propose_higher_gain, propose_slower_drive):
                    break
    if analysis.outcome is Outcome.LOCAL_MINIMUM and len(advice) < MOST_REMEDIES:
        advice += advise_via_pose(analysis)
    return advice


def report_trial(
    analysis: RunAnalysis, about: str, how: str, case: Experiment, trial: AblationTrial
) -> Finding:
    """Return the advice of a case that converged in a trial."""
    sentence, evidence = (
        f"{how} the same start {trial.clause}.",
        {"converges_after_s": trial.end_time},
    )
    return Finding(about, sentence, evidence, find_trial_changes(analysis.case, case, trial))


def propose_interaction(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with each other named choice of L."""
    choices = [leaf.interaction for leaf in list_servo_tasks(analysis.case.task)]
    used = {which if isinstance(which, str) else "" for which in choices}
    if len(used) != 1:
        return
    for which in ("mean", "desired", "current"):
        if which not in used:
            case = counterfactuals.replace_task_fields(analysis.extended_case, interaction=which)
            yield "interaction", f"With L {which}", case


def propose_law(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with the other law."""
    servo = analysis.servo
    used = LAWS.name_of(servo.law) if servo else None
    for which in {"joint", "camera"} - {used} if used in ("joint", "camera") else ():
        own = getattr(analysis.case.task, "law", None)
        law = replace(own, law=which) if isinstance(own, ConstrainedLaw) else which
        case = counterfactuals.replace_task_fields(
            analysis.case if analysis.is_falling else analysis.extended_case, law=law
        )
        yield "law", f"With law '{which}'", case


def propose_scheme(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with image-based instead of position-based servoing, or vice versa.

    For a unicycle, docking is yielded as well.
    """
    task = analysis.case.task
    others: dict[type, tuple[type[ServoTask], ...]] = {IBVS: (PBVS, Docking), PBVS: (IBVS, Docking)}
    names = ["goal", "camera", "target", "gain", "belief", "joints"]
    if isinstance(getattr(task, "law", None), ConstrainedLaw):
        names.append("law")
    for other in others.get(type(task), ()):
        shared = {name: getattr(task, name) for name in names}
        with suppress(InputError):  # such as a goal that this scheme does not support
            case = analysis.extended_case.with_(task=other(**shared))
            yield other.__name__, f"With {other.__name__}", case


def propose_coarser_pictures(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with pictures that are smoother, which widens the basin."""
    servo = analysis.servo
    parts = servo.bound_features.parts if servo else ()
    if len(parts) != 1 or not isinstance(parts[0].feature, Luminance):
        return
    own = parts[0].feature
    for level in (own.level + 1, own.level + 2):
        with suppress(InputError):  # of pictures that become too small
            coarser = replace(own, level=level)
            case = counterfactuals.replace_task_fields(analysis.extended_case, features=coarser)
            yield "level", f"With pictures at level {level}", case
    with suppress(InputError):
        damped = replace(own, damping=10.0 * (own.damping or 1e-3))
        case = counterfactuals.replace_task_fields(analysis.extended_case, features=damped)
        yield "damping", f"With a damping of {format_number(damped.damping)}", case


def propose_inverse(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with a damped inverse in a singularity, else with a pseudo-inverse."""
    used = INVERSES.name_of(analysis.servo.inverse) if analysis.servo else None
    other = "damped" if analysis.outcome is Outcome.SINGULAR else "pseudo_inverse"
    if used and used != other:
        case = counterfactuals.replace_task_fields(analysis.extended_case, inverse=other)
        yield "inverse", f"With inverse='{other}'", case


def propose_no_speed_limit(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case without its speed limit."""
    if any(leaf.limit for leaf in list_servo_tasks(analysis.case.task)):
        case = counterfactuals.replace_task_fields(analysis.case, limit=None)
        yield "limit", "Without its speed limit", case


def propose_lower_gain(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with half, a quarter and a tenth of the gain, unless time is short."""
    if not (analysis.outcome is Outcome.TIME_LIMIT and analysis.is_falling):
        for factor, word in LOWER_GAINS.items():
            yield _propose_gain(analysis, analysis.extended_case, factor, word)


def propose_higher_gain(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with two, four and ten times the gain, in the same time."""
    for factor, word in HIGHER_GAINS.items():
        if factor * analysis.gain * analysis.case.dt < OVERSHOOT:
            yield _propose_gain(analysis, analysis.case, factor, word)


def _propose_gain(analysis: RunAnalysis, case: Experiment, factor: float, word: str) -> Proposal:
    """Return the case with its gain times a factor."""
    how = f"With {word} the gain ({format_number(factor * analysis.gain)} per second)"
    return "gain", how, counterfactuals.scale_gain(case, factor)


def propose_larger_image(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with larger images."""
    case = counterfactuals.enlarge_images(analysis.extended_case)
    yield "image", "With an image twice as wide and high", case


def propose_border_weighting(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with weighting="border", unless marks may leave the image already."""
    if not analysis.controller.optional_pairs:
        case = counterfactuals.replace_task_fields(analysis.extended_case, weighting="border")
        yield "weighting", "With weighting='border'", case


def propose_limit_avoidance(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with limit avoidance, if the robot is redundant."""
    controller = analysis.controller
    if controller.columns.size > controller.full_rank:
        case = counterfactuals.replace_task_fields(analysis.extended_case, secondary=AvoidLimits())
        yield "secondary", "With secondary=AvoidLimits()", case


def propose_more_time(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with more time, if the error still falls."""
    if analysis.is_falling:
        yield "duration", "Given more time", analysis.extended_case


def propose_feed_forward(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with feed-forward, if the scene has prescribed motions."""
    if not analysis.case.scene.motions:
        return
    for which in ("known", "estimated"):
        case = counterfactuals.replace_task_fields(analysis.case, feed_forward=which)
        yield "feed_forward", f"With feed_forward='{which}'", case


def propose_slower_drive(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with lower bandwidths of its drive, if the drive has a bandwidth."""
    drive: Any = analysis.case.actuation.drive
    name = next((each for each in ("bandwidth", "frequency") if hasattr(drive, each)), None)
    for factor, word in LOWER_GAINS.items() if name is not None else ():
        value = factor * getattr(drive, str(name))
        slower = replace(drive, **{str(name): value})
        actuation = replace(analysis.case.actuation, drive=slower)
        how = f"With {word} the {name} of the drive ({format_number(value)} rad/s)"
        yield str(name), how, analysis.extended_case.with_(actuation=actuation)


def propose_tolerance(analysis: RunAnalysis) -> Iterator[Proposal]:
    """Yield the case with a tolerance above the final error."""
    if analysis.is_falling:
        return
    third = analysis.errors[-max(len(analysis.errors) // 3, 1) :]
    larger = float(f"{1.5 * float(np.median(third)):.2g}")
    tolerances = analysis.controller.tolerances
    if (tolerances == tolerances[0]).all() and analysis.tolerance < larger < 0.2 * analysis.errors[
        0
    ]:
        case = counterfactuals.replace_task_fields(analysis.case, tolerance=larger)
        yield "tolerance", f"With a tolerance of {analysis.size(larger)}", case


_REMEDIES: dict[Outcome, tuple[ProposalSource, ...]] = {
    Outcome.RUNNING: (),
    Outcome.ENDED: (),
    Outcome.UNDETECTED: (),
    Outcome.NO_GRADIENT: (),
    Outcome.NOTHING_IN_VIEW: (propose_coarser_pictures, propose_interaction, propose_lower_gain),
    Outcome.CONVERGED: (),
    Outcome.UNSTABLE: (propose_lower_gain, propose_slower_drive),
    Outcome.LOCAL_MINIMUM: (
        *(propose_coarser_pictures, propose_metric, propose_rollout, propose_interaction),
        *(propose_law, propose_scheme),
    ),
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
        propose_slower_drive,
        propose_inverse,
        propose_interaction,
        propose_law,
        propose_scheme,
    ),
    Outcome.NOT_FINITE: (propose_lower_gain, propose_inverse, propose_interaction, propose_law),
    Outcome.TIME_LIMIT: (
        *(propose_coarser_pictures, propose_feed_forward, propose_no_speed_limit),
        *(propose_inverse, propose_higher_gain),
        *(propose_more_time, propose_lower_gain, propose_law, propose_tolerance),
    ),
}


def propose_robust_weighting(analysis: RunAnalysis) -> Iterator[Finding]:
    """Yield the advice of robust weights if there are outliers, and robust weights help.

    Robust weights help if the run converges with them. If noise prevents convergence, they help if
    they halve the mean distance to the goal over the second half of the run, or reduce it further.
    """
    case = (
        counterfactuals.add_robust_weighting(analysis.case)
        if _has_outliers(analysis.case)
        else None
    )
    trial = run_trial(case) if case is not None else None
    if case is None or trial is None:
        return
    others = any(leaf.weighting for leaf in list_servo_tasks(analysis.case.task))
    how = f"With weighting='tukey'{' beside the present weighting' * others}"
    if trial.converged:
        yield report_trial(analysis, "weighting", how, case, trial)
        return
    before, after = (_mean_goal_distance(each) for each in (analysis.loop, trial.loop))
    if trial.outcome is analysis.outcome and after < NEAR_SHARE * before:
        sentence = (
            f"{how} the mean distance to the goal in the second half of the run is "
            f"{format_length(after)} instead of {format_length(before)}."
        )
        evidence = {"off_m": after, "was_off_m": before}
        yield Finding("weighting", sentence, evidence, find_path_changes(analysis.case, case))


def _has_outliers(case: Experiment) -> bool:
    """Return whether the images have outliers and no weighting is robust."""
    effects = [each.effect for each in case.sensing.list_active()]
    has_outliers = any(effect.deviation(True) < effect.deviation(False) for effect in effects)
    return has_outliers and not has_robust_weighting(case.task)


def _mean_goal_distance(loop: Loop) -> float:
    """Return the mean distance (m) to the goal over the second half of a single run."""
    q = loop.recorder.series.q[0, : int(loop.recorder.end_step[0]) + 1]
    late = np.ascontiguousarray(q[len(q) // 2 :].T)
    start = np.repeat(loop.q0, late.shape[1], axis=0)
    return float(end_variables.measure_goal_offset(loop.controller, late, start)[1].mean())
