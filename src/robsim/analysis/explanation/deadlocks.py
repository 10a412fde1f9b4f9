"""Ways out of a standstill at constraints: another metric, a law that looks ahead, a via pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation import counterfactuals
from robsim.analysis.explanation.ablation import run_converging_trial
from robsim.analysis.explanation.active_constraints import list_holding_constraints
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length, format_number
from robsim.analysis.task_tree import list_servo_tasks
from robsim.geometry.pose import Pose
from robsim.run.experiment import Experiment
from robsim.servo.goals.goal import GoalPose
from robsim.servo.laws.constrained_law import ConstrainedLaw
from robsim.servo.laws.rollout_law import RolloutLaw
from robsim.servo.tasks.schemes import PBVS

RETREATS = 0.5, 1.0  # distances of a via pose behind the goal, in depths of the goal


def propose_metric(analysis: RunAnalysis) -> Iterator[tuple[str, str, Experiment | None]]:
    """Yield the case of a law with constraints in the other metric."""
    for leaf in list_servo_tasks(analysis.case.task):
        if isinstance(leaf.law, ConstrainedLaw) and list_holding_constraints(analysis):
            other: Any = "joint" if leaf.law.metric == "error" else "error"
            law = replace(leaf.law, metric=other)
            case = counterfactuals.replace_task_fields(analysis.extended_case, law=law)
            yield "metric", f"With metric='{other}' of the constraints", case
            return


def propose_rollout(analysis: RunAnalysis) -> Iterator[tuple[str, str, Experiment | None]]:
    """Yield the case of a law with constraints that looks ahead, with PBVS as another scheme."""
    for leaf in list_servo_tasks(analysis.case.task):
        if isinstance(leaf.law, ConstrainedLaw) and list_holding_constraints(analysis):
            law = RolloutLaw([leaf.law], schemes=[PBVS(law=leaf.law)])
            case = counterfactuals.replace_task_fields(analysis.extended_case, law=law)
            yield "rollout", "With a law that looks ahead, and PBVS as another scheme,", case
            return


def advise_via_pose(analysis: RunAnalysis) -> Iterator[Finding]:
    """Yield the advice of a via pose farther from the target, if constraints hold the robot."""
    if analysis.goal_pose is None or not list_holding_constraints(analysis):
        return
    T = analysis.goal_pose.matrix
    for share in RETREATS:
        away = T.copy()
        away[2, 3] *= 1.0 + share
        seconds = _simulate_two_legs(analysis, GoalPose(Pose(away)))
        if seconds is not None:
            distance = share * float(T[2, 3])
            sentence = (
                f"Over a via pose {format_length(distance)} farther from the target the same start "
                f"converges after {format_number(seconds)} s."
            )
            yield Finding("via pose", sentence, {"converges_after_s": seconds, "via_m": distance})
            return


def _simulate_two_legs(analysis: RunAnalysis, via: GoalPose) -> float | None:
    """Return the time of a run to a via pose and from there to the goal; None if one fails."""
    case = counterfactuals.replace_task_fields(analysis.extended_case, goal=via)
    first = None if case is None else run_converging_trial(case)
    if first is None:
        return None
    start = np.array(first.loop.recorder.last.q[0, 0])
    second = run_converging_trial(analysis.extended_case.with_(start=start))
    return None if second is None else first.end_time + second.end_time
