"""Constraints of a law: as the reason of a standstill, and as advice for a lost run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from robsim.analysis.explanation import counterfactuals
from robsim.analysis.explanation.ablation import AblationTrial, run_trial
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.path_changes import find_trial_changes
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.engine.outcome import Outcome
from robsim.run.active_constraints import select_holding_constraints
from robsim.run.experiment import Experiment
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.servo.constraints.joint_limits import JointLimits
from robsim.servo.constraints.joint_speeds import JointSpeeds
from robsim.servo.constraints.mark_depth import MarkDepth
from robsim.servo.laws.constrained_law import ConstrainedLaw

MOST_NAMES = 4  # most constraints that a sentence names
LEAST_PRICE = 1e-3  # relative growth of a path that is worth a word
ANSWERS: dict[Outcome, tuple[Any, str]] = {  # the constraint against an outcome, in words
    Outcome.OUT_OF_IMAGE: (FieldOfView(), "the field of view"),
    Outcome.BEHIND_CAMERA: (MarkDepth(), "the depth of the marks"),
    Outcome.JOINT_LIMIT: (JointLimits(), "the joint limits"),
}
SLOWER = JointSpeeds(1.0), "the speed of joints, at most 1 rad/s or 1 m/s,"


def list_holding_constraints(analysis: RunAnalysis) -> list[str]:
    """Return the names of the constraints that hold the command at the end of the run."""
    labels = analysis.controller.constraint_labels
    if not labels:
        return []
    return select_holding_constraints(analysis.loop.recorder.last.active[0, 0], list(labels))


def report_constraints(analysis: RunAnalysis) -> Finding | None:
    """Report the constraints that hold the command at the end of the run."""
    names = list_holding_constraints(analysis)
    if not names:
        return None
    shown = format_list(names[:MOST_NAMES])
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    largest = float(analysis.loop.recorder.last.active[0, 0].max())
    slack = float(analysis.loop.recorder.last.slack[0, 0].max())
    reason = (
        "No command satisfies all of them, so that one gives way"
        if slack > 0.0
        else "The scheme wishes a motion that they forbid, and no permitted motion is nearer to it"
    )
    sentence = f"The constraints of the law hold the command back: {shown}{more}. {reason}."
    evidence = {"constraints": float(len(names)), "multiplier": largest, "slack": slack}
    return Finding("constraint", sentence, evidence)


def advise_constraints(analysis: RunAnalysis) -> Iterator[Finding]:
    """Yield the advice of constraints within the law, with the price in path length."""
    if analysis.outcome not in ANSWERS:
        return
    one, name = ANSWERS[analysis.outcome]
    if analysis.controller.constraint_labels and analysis.outcome is not Outcome.JOINT_LIMIT:
        one, name = SLOWER  # a barrier in the image holds in the first order of the period
    case = _add_constraint(analysis.extended_case, one)
    trial = run_trial(case) if case is not None else None
    if case is None or trial is None or not trial.converged:
        return
    sentence = f"With {name} as a constraint of the law the same start {trial.clause}"
    evidence = {"converges_after_s": trial.end_time}
    price = _measure_price(analysis, trial)
    if price is not None:
        sentence += f", on a path {format_number(100 * price)} percent longer than without borders"
        evidence["path_price"] = price
    yield Finding(
        "constraint", f"{sentence}.", evidence, find_trial_changes(analysis.case, case, trial)
    )


def _measure_price(analysis: RunAnalysis, trial: AblationTrial) -> float | None:
    """Return the relative growth of the path by the constraints; None if it is unknown or none.

    The path is compared with that of the same law in a scene without borders and joint limits.
    """
    free = counterfactuals.remove_joint_limits(
        counterfactuals.remove_border(analysis.extended_case)
    )
    other = run_trial(free)
    if other is None or not other.converged:
        return None
    lengths = [float(each.loop.recorder.path_length[0]) for each in (trial, other)]
    price = lengths[0] / lengths[1] - 1.0 if lengths[1] > 0.0 else 0.0
    return price if price >= LEAST_PRICE else None


def _add_constraint(case: Experiment, one: Any) -> Experiment | None:
    """Return the case with another constraint in the law of every servo task, None if it fails."""

    def constrain(law: Any) -> Any:
        if not isinstance(law, ConstrainedLaw):
            return ConstrainedLaw([one], law)
        others = [each for each in law.constraints if type(each) is not type(one)]
        return replace(law, constraints=(*others, one))

    def change(leaf: Any) -> Any:
        law = leaf.law
        if hasattr(law, "laws"):  # candidates of a law that looks ahead
            return replace(leaf, law=replace(law, laws=[constrain(each) for each in law.laws]))
        return replace(leaf, law=constrain(law))

    return counterfactuals.change_servo_tasks(case, change)
