"""Causes of lost targets and exceeded joint limits: obstacles and detours."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.counterfactuals import remove_border, remove_joint_limits
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.outcome_sentences import find_passed_limit
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import (
    format_angle,
    format_moving_robots,
    format_number,
)

RETREAT_RATIO = 1.5  # least ratio of the farthest depth to the depths at start and goal
LARGE_ROLL = np.pi / 3  # least rotation about the optical axis that explains a retreat


def report_blind_start(analysis: RunAnalysis) -> Finding | None:
    """Report a start without the target in the image."""
    if analysis.end > 0:
        return None
    excused = analysis.controller.optional_pairs
    sees = "sees too few marks for a command" if excused else "does not see all marks"
    sentence = f"At the start the camera {sees}: take another start."
    return Finding("start", sentence)


def report_pose_features(analysis: RunAnalysis) -> Finding | None:
    """Report a position-based scheme, which does not control the image."""
    if not _is_position_based(analysis):
        return None
    return Finding(
        "no control of the image",
        "The scheme is position-based: it regulates the pose of the camera, and nothing in its "
        "law keeps the marks in the image.",
    )


def _is_position_based(analysis: RunAnalysis) -> bool:
    """Return whether all features of the task are pose features."""
    parts = analysis.servo.bound_features.parts if analysis.servo else ()
    return bool(parts) and all(getattr(p.feature, "uses_pose", False) for p in parts)


def report_retreat(analysis: RunAnalysis) -> Finding | None:
    """Report a camera that backed away, as it does for rotations about the optical axis."""
    depths, goal, turn = analysis.depths, analysis.goal_pose, analysis.start_rotation
    reference = float(depths[0])
    if goal is not None:
        marks = np.asarray(goal @ analysis.sight.target.marks)
        reference = max(reference, float(marks[..., 2].mean()))
    farthest = float(np.nanmax(depths))
    if farthest < RETREAT_RATIO * reference:
        return None
    evidence = {"from_m": float(depths[0]), "to_m": farthest}
    sentence = (
        f"The camera retreated: the marks were {format_number(depths[0])} m away at the start and "
    )
    sentence += (
        f"{format_number(farthest)} m at most{', farther than at the goal' if goal else ''}."
    )
    if turn is not None and abs(turn[2]) > LARGE_ROLL and not _is_position_based(analysis):
        evidence["roll_deg"] = float(np.degrees(abs(turn[2])))
        sentence += (
            f" Start and goal differ by {format_angle(abs(turn[2]))} about the optical axis, and "
            "the straight paths that the law commands for the points make the camera back away "
            "(Chaumette 1998)."
        )
    return Finding("camera retreat", sentence, evidence)


def report_roll(analysis: RunAnalysis) -> Finding | None:
    """Report a large rotation about the optical axis without a retreat."""
    turn = analysis.start_rotation
    if (
        turn is None
        or abs(turn[2]) < LARGE_ROLL
        or _is_position_based(analysis)
        or report_retreat(analysis)
    ):
        return None
    angle = abs(turn[2])
    sentence = (
        f"Start and goal differ by {format_angle(angle)} about the optical axis, far beyond the "
        "neighbourhood in which L describes how the points move."
    )
    return Finding("rotation about the axis", sentence, {"roll_deg": float(np.degrees(angle))})


def report_border(analysis: RunAnalysis) -> Finding | None:
    """Report the image border if it is the only obstacle."""
    trial = analysis.trial(remove_border)
    if trial is None or not trial.converged:
        return None
    sentence = (
        "Only the border of the image is an obstacle: with an image without border the same run "
        f"{trial.clause}."
    )
    return Finding("border", sentence, {"converges_after_s": trial.end_time})


def report_joint_limit(analysis: RunAnalysis) -> Finding | None:
    """Report whether the exceeded joint limit is the only obstacle."""
    name, side, limit, _, _ = find_passed_limit(analysis)
    trial = analysis.trial(remove_joint_limits)
    if trial is None:
        return None
    if trial.converged:
        end = f"without limits the same run {trial.clause}."
        return Finding(
            "joint limit",
            f"The {side} limit of {name} is the only obstacle: {end}",
            {"limit": limit, "converges_after_s": trial.end_time},
        )
    return Finding(
        "joint limit",
        f"The {side} limit of {name} is not the cause: without limits the run ends as "
        f"{trial.outcome.name} after {format_number(trial.end_time)} s.",
        {"limit": limit},
    )


def report_visibility(analysis: RunAnalysis) -> Finding | None:
    """Report the least number of marks in the image, and the condition number of L J."""
    marks = analysis.measures["marks_in_image"]
    every = analysis.controller.marks
    controller = analysis.controller
    excused = controller.optional_pairs - controller.pictured_pairs
    if not excused or marks.min() == every:
        return None
    conditions = analysis.measures["condition_task_jacobian"]
    worst = float(np.nanmax(conditions)) if np.isfinite(conditions).any() else np.nan
    sentence = (
        f"Marks left the image or came into it: {marks[0]} of {every} were in it at the start, "
        f"never fewer than {marks.min()}, and {marks[-1]} at the end; the largest condition number "
        f"of L J, for the marks in the image, was {format_number(worst)}."
    )
    return Finding("visibility", sentence, {"least_marks": float(marks.min()), "condition": worst})


def report_own_motion(analysis: RunAnalysis) -> Finding | None:
    """Report prescribed motions of robots."""
    if not analysis.case.scene.motions:
        return None
    return Finding("own motion", f"{format_moving_robots(analysis.case.scene)} meanwhile.")


def report_near_border(analysis: RunAnalysis) -> Finding | None:
    """Report a mark that came close to the border of its image."""
    margins = analysis.measures["border_margin"]
    if analysis.controller.optional_pairs or not np.isfinite(margins).any():
        return None
    t = int(np.nanargmin(margins))
    if margins[t] > 5 or t == 0:
        return None
    sentence = (
        f"A mark came within {format_number(margins[t])} px of the border of its image, after "
        f"{format_number(t * analysis.case.dt)} s."
    )
    return Finding("near border", sentence, {"margin_px": float(margins[t])})
