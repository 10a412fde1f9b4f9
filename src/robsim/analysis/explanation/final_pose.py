"""Comparison of the final camera pose with the goal pose, and causes of a difference."""

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
from robsim.analysis.explanation.goal_motion import report_goal_motion
from robsim.analysis.explanation.half_turns import find_upright_schemes, report_half_turn
from robsim.analysis.explanation.imperfections import list_imperfections
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_count, format_offset
from robsim.base.arrays import move_runs_last
from robsim.engine.loop import Loop
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.servo.task_controller import TaskController

FAR_METRES, FAR_RADIANS = 1e-3, 2e-3  # metres and radians above which an offset is reported
NEAR_SHARE = 0.1  # offset below which the camera is at its goal, relative to the former offset


def report_final_pose(analysis: RunAnalysis) -> list[Finding]:
    """Report a converged run that ends away from its goal pose, and the cause."""
    loop = analysis.loop
    offset, is_determined = measure_final_offset(loop), _is_pose_determined(loop.controller)
    far_metres, far_radians = (
        (FAR_METRES, FAR_RADIANS) if is_determined else (end_variables.FAR, end_variables.TURNED)
    )
    if math.isnan(offset[0]) and end_variables.count_free_motions(loop.controller):
        return [_report_free_motions(analysis)]  # a goal given as numbers has no pose
    if not (offset[0] > far_metres or offset[1] > far_radians):
        return []
    wrong = list_imperfections(analysis)
    first = [_report_displacement(loop.controller, offset, bool(wrong))]
    half_turn = report_half_turn(analysis, offset)
    first += [half_turn] if half_turn else []
    if not is_determined:
        return [*first, _report_free_motions(analysis), *report_goal_motion(analysis, -1)]
    if half_turn or not analysis.trials:
        return first
    test = _make_nearness_test(offset, float(analysis.depths[-1]))
    criterion = SuccessCriterion(test, lambda _: "the camera reaches its goal pose")
    causes = criterion.attribute(analysis.case, wrong).causes
    return [*first, *(causes or _explain_displacement(analysis, test, bool(wrong)))]


def advise_final_pose(analysis: RunAnalysis) -> tuple[Finding, ...]:
    """Return the schemes that end a converged run at its goal pose, not upside down."""
    offset = measure_final_offset(analysis.loop)
    if not analysis.trials or not report_half_turn(analysis, offset):
        return ()
    test = _make_nearness_test(offset, float(analysis.depths[-1]))
    return tuple(find_upright_schemes(analysis, test))


def _is_pose_determined(controller: TaskController) -> bool:
    """Return whether features at their goal determine the pose, up to a few solutions."""
    commanded = controller.columns.size >= 6 and not end_variables.count_free_motions(controller)
    return commanded or controller.full_rank >= 6


def _report_displacement(
    controller: TaskController, offset: tuple[float, float], wrong: bool
) -> Finding:
    """Report the distance of the end of the run from the goal pose."""
    part = end_variables.select_goal_controller(controller)
    subject = "the camera" if part.moving == part.frame else f"'{part.moving}'"
    as_seen = "as the controller sees and believes it" if wrong else "but not in space"
    sentence = (
        f"It converged in the image {as_seen}: the true pose of {subject} is "
        f"{format_offset(*offset)} off its goal pose."
    )
    return Finding(
        "final pose", sentence, {"off_m": offset[0], "angle_deg": math.degrees(offset[1])}
    )


def _report_free_motions(analysis: RunAnalysis) -> Finding:
    """Report why features at their goal do not determine the pose."""
    controller = analysis.controller
    free, count = end_variables.count_free_motions(controller), controller.columns.size
    if free:
        sentence = (
            f"The features leave {format_count(free, 'motion')} of the joints free, and so "
            f"they are at their goal in many poses. {_suggest_features(analysis)}"
        )
    else:
        sentence = (
            f"A pose has six numbers, and {count} velocities are commanded: the features are at "
            "their goal in other poses too."
        )
    return Finding("free motions", sentence, {"free_motions": free, "velocities": count})


def _suggest_features(analysis: RunAnalysis) -> str:
    """Return advice on features that distinguish the poses."""
    marks = analysis.sight.target.marks
    if np.linalg.matrix_rank(marks - marks[0], tol=1e-9) < 2:
        return "Three or more marks that are not collinear distinguish these."
    return "More features or marks distinguish these."


def _explain_displacement(
    analysis: RunAnalysis, is_nearer: SuccessTest, wrong: bool
) -> Iterator[Finding]:
    """Report why a camera ends away from its goal pose without any imperfection."""
    finer = 1e-3 * analysis.tolerance
    case = replace_task_fields(extend_duration(analysis.case), tolerance=finer)
    if case is None or not run_converging_trial(case):
        return
    if is_nearer(case):
        yield Finding(
            "tolerance",
            f"The tolerance of {analysis.size(analysis.tolerance)} allows this: with "
            f"{analysis.size(finer)} the camera reaches its goal pose.",
            {"tolerance": analysis.tolerance, "finer": finer},
        )
    elif not wrong:
        yield Finding(
            "ambiguous features",
            "The features have the same values at both poses; three marks, for example, look the "
            "same from up to four poses. More marks distinguish the poses.",
        )


def measure_final_offset(loop: Loop) -> tuple[float, float]:
    """Return the distance (m) and angle (rad) of the first camera from its goal at the end."""
    q_end = move_runs_last(loop.recorder.last.q[:, 0], 1)
    _, metres, radians = end_variables.measure_goal_offset(loop.controller, q_end, loop.q0)
    return float(metres[0]), float(radians[0])


def _make_nearness_test(offset: tuple[float, float], depth: float) -> SuccessTest:
    """Return a test of trials: it succeeds if the camera ends nearer to its goal pose.

    A translation counts as the angle under which it appears at a depth (m).
    """

    def apparent(offset_of_run: tuple[float, float]) -> float:
        return max(offset_of_run[0] / depth, offset_of_run[1])

    def is_nearer(case: Experiment) -> AblationTrial | None:
        trial = run_converging_trial(case)
        if trial is None:
            return None
        value = apparent(measure_final_offset(trial.loop))
        return trial if value < max(FAR_RADIANS, NEAR_SHARE * apparent(offset)) else None

    return is_nearer
