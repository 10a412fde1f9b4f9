"""Comparison of the final camera pose with the intended one, and causes of a difference."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from robsim.analysis.explanation.ablation import (
    AblationTrial,
    extend_duration,
    run_converging_trial,
)
from robsim.analysis.explanation.attribution import SuccessCriterion, SuccessTest
from robsim.analysis.explanation.counterfactuals import replace_task_fields
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.imperfections import list_imperfections
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_count, format_offset
from robsim.base.arrays import move_runs_last
from robsim.engine.loop import Loop
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.servo.task_controller import TaskController

FAR_METRES, FAR_RADIANS = 1e-3, 2e-3  # metres and radians above which a distance is reported
NEAR_SHARE = 0.1  # share of its distance below which the camera counts as at its goal


def report_final_pose(inquiry: RunAnalysis) -> list[Finding]:
    """Report a converged run that stands away from its goal pose, and the cause."""
    loop = inquiry.loop
    off, full = measure_final_offset(loop), _is_pose_determined(loop.controller)
    far, turned = (FAR_METRES, FAR_RADIANS) if full else (end_variables.FAR, end_variables.TURNED)
    if math.isnan(off[0]) and end_variables.count_free_motions(loop.controller):
        return [
            _report_free_motions(inquiry)
        ]  # of a goal that is numbers: no pose is the right one
    if not (off[0] > far or off[1] > turned):
        return []
    wrong = list_imperfections(inquiry)
    first = _report_displacement(loop.controller, off, bool(wrong))
    if not full:
        return [first, _report_free_motions(inquiry)]
    if not inquiry.trials:
        return [first]
    cured = _make_nearness_test(off, float(inquiry.depths[-1]))
    stands = SuccessCriterion(cured, lambda _: "the camera stands where it should")
    causes = stands.attributed(inquiry.case, wrong).causes
    return [first, *(causes or _explain_displacement(inquiry, cured, bool(wrong)))]


def _is_pose_determined(controller: TaskController) -> bool:
    """Return whether features at their goal determine the pose, up to a few solutions."""
    commanded = controller.columns.size >= 6 and not end_variables.count_free_motions(controller)
    return commanded or controller.full_rank >= 6


def _report_displacement(
    controller: TaskController, off: tuple[float, float], wrong: bool
) -> Finding:
    """Report how far from the goal pose the run ended."""
    part = end_variables.select_goal_controller(controller)
    who = "the camera" if part.moving == part.frame else f"'{part.moving}'"
    as_seen = "as the controller sees and believes it" if wrong else "but not in space"
    sentence = (
        f"It converged in the image {as_seen}: in truth {who} stands {format_offset(*off)} away from "
        "where it was meant to stand."
    )
    return Finding("final pose", sentence, {"off_m": off[0], "angle_deg": math.degrees(off[1])})


def _report_free_motions(inquiry: RunAnalysis) -> Finding:
    """Report why features at their goal do not determine the pose."""
    controller = inquiry.controller
    free, count = end_variables.count_free_motions(controller), controller.columns.size
    if free:
        sentence = (
            f"The features leave {format_count(free, 'motion')} free that the joints can make, and so "
            f"they have their goal at many poses. {_suggest_features(inquiry)}"
        )
    else:
        sentence = (
            f"A pose has six numbers, and the velocities that are commanded are {count}: the "
            "features have their goal at other poses too."
        )
    return Finding("free motions", sentence, {"free_motions": free, "velocities": count})


def _suggest_features(inquiry: RunAnalysis) -> str:
    """Return advice on what would tell the poses apart."""
    marks = inquiry.sight.target.marks
    if np.linalg.matrix_rank(marks - marks[0], tol=1e-9) < 2:
        return "Three marks or more that are not on one line tell these apart."
    return "More features or marks tell these apart."


def _explain_displacement(
    inquiry: RunAnalysis, cured: SuccessTest, wrong: bool
) -> Iterator[Finding]:
    """Report why a camera ends away from its goal pose without any imperfection."""
    finer = 1e-3 * inquiry.tolerance
    case = replace_task_fields(extend_duration(inquiry.case), tolerance=finer)
    if case is None or not run_converging_trial(case):
        return
    if cured(case):
        yield Finding(
            "tolerance",
            f"The tolerance of {inquiry.size(inquiry.tolerance)} leaves that: with "
            f"{inquiry.size(finer)} the camera stands where it should.",
            {"tolerance": inquiry.tolerance, "finer": finer},
        )
    elif not wrong:
        yield Finding(
            "ambiguous features",
            "The features have the same values at both poses; three marks, for one, look the same "
            "from up to four. More marks tell the poses apart.",
        )


def measure_final_offset(loop: Loop) -> tuple[float, float]:
    """Return the distance (m) and angle (rad) of the first camera from its goal at the end."""
    q_end = move_runs_last(loop.recorder.last.q[:, 0], 1)
    _, metres, radians = end_variables.measure_goal_offset(loop.controller, q_end, loop.q0)
    return float(metres[0]), float(radians[0])


def _make_nearness_test(off: tuple[float, float], depth: float) -> SuccessTest:
    """Return the test whether a change brings the camera nearer to its goal pose.

    A translation counts as the angle at which it is seen.
    """

    def apparent(miss: tuple[float, float]) -> float:
        return max(miss[0] / depth, miss[1])

    def cured(case: Experiment) -> AblationTrial | None:
        trial = run_converging_trial(case)
        if trial is None:
            return None
        now = apparent(measure_final_offset(trial.loop))
        return trial if now < max(FAR_RADIANS, NEAR_SHARE * apparent(off)) else None

    return cured
