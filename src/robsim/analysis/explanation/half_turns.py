"""Runs with image moments that converge upside down, and schemes that end upright."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress

from robsim.analysis.explanation.ablation import extend_duration
from robsim.analysis.explanation.attribution import SuccessTest
from robsim.analysis.explanation.counterfactuals import replace_task_fields
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.path_changes import find_trial_changes
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_angle
from robsim.base.errors import InputError
from robsim.features.moments import DecoupledMoments, PointMoments, RegionMoments
from robsim.run.end_variables import UPSIDE_DOWN
from robsim.run.experiment import Experiment
from robsim.servo.tasks.schemes import PBVS

Moments = RegionMoments | PointMoments | DecoupledMoments


def report_half_turn(analysis: RunAnalysis, offset: tuple[float, float]) -> Finding | None:
    """Report a converged run with moments whose camera is upside down; else None.

    `offset` is the distance (m) and the angle (rad) of the camera from its goal at the end.
    """
    moments = _list_moments(analysis)
    if not moments or not offset[1] > UPSIDE_DOWN:
        return None
    sentence = (
        f"It converged upside down, turned by {format_angle(offset[1])}: the features are moments, "
        f"and {_describe_ambiguity(moments)}."
    )
    return Finding("upside down", sentence, {"angle_deg": math.degrees(offset[1])})


def _describe_ambiguity(moments: list[Moments]) -> str:
    """Return a clause on the reason why moments are at their goal upside down."""
    decoupled = [each for each in moments if isinstance(each, DecoupledMoments)]
    if len(decoupled) < len(moments):
        return "their angle belongs to an axis without a head, and is determined up to half a turn"
    if any(each.has_head for each in decoupled):
        return "they have the same values at both poses"
    return (
        "the third moments of the target at the goal are so small that a tilt could explain them, "
        "and do not decide between an angle and the angle half a turn further"
    )


def find_upright_schemes(analysis: RunAnalysis, is_nearer: SuccessTest) -> Iterator[Finding]:
    """Yield the advice of schemes with which the same start ends at the goal pose."""
    for how, case in _propose_schemes(analysis):
        trial = is_nearer(case)
        if trial is not None:
            sentence = f"{how} the same start {trial.clause}, at its goal pose."
            evidence = {"converges_after_s": trial.end_time}
            changes = find_trial_changes(analysis.case, case, trial)
            yield Finding("features", sentence, evidence, changes)


def _propose_schemes(analysis: RunAnalysis) -> Iterator[tuple[str, Experiment]]:
    """Yield cases with features that distinguish the ends of a target."""
    case, task = extend_duration(analysis.case), analysis.case.task
    decoupled = None
    if not any(isinstance(each, DecoupledMoments) for each in _list_moments(analysis)):
        decoupled = replace_task_fields(case, features=DecoupledMoments())
    if decoupled is not None:
        yield "With DecoupledMoments as features", decoupled
    points = replace_task_fields(case, features="points", interaction="mean")
    if points is not None:
        yield "With the feature points and L mean", points
    names = ("goal", "camera", "target", "gain", "belief", "joints")
    with suppress(InputError, AttributeError):
        scheme = PBVS(**{name: getattr(task, name) for name in names})
        yield "With PBVS", case.with_(task=scheme)


def _list_moments(analysis: RunAnalysis) -> list[Moments]:
    """Return the moments among the features of a single servo task."""
    parts = analysis.servo.bound_features.parts if analysis.servo else ()
    return [part.feature for part in parts if isinstance(part.feature, Moments)]
