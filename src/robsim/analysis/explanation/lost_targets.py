"""Reasons why a camera lost its target or a joint passed a limit: obstacles and detours."""

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

RETREAT_RATIO = 1.5  # times the larger distance of start and goal, from which it is a retreat
LARGE_ROLL = np.pi / 3  # rotation about the optical axis from which it explains a retreat


def report_blind_start(inquiry: RunAnalysis) -> Finding | None:
    """Report a start from which the camera does not see the target."""
    if inquiry.end > 0:
        return None
    excused = inquiry.controller.excused
    sees = "sees too few marks to command by" if excused else "does not see all marks"
    sentence = f"The run starts where the camera {sees}: take another start."
    return Finding("start", sentence)


def report_pose_features(inquiry: RunAnalysis) -> Finding | None:
    """Report a position-based scheme, which does not control the image."""
    if not _is_position_based(inquiry):
        return None
    return Finding(
        "no control of the image",
        "The scheme is position-based: it regulates the pose of the camera, and nothing in its "
        "law keeps the marks in the image.",
    )


def _is_position_based(inquiry: RunAnalysis) -> bool:
    parts = inquiry.servo.regulated.parts if inquiry.servo else ()
    return bool(parts) and all(getattr(p.feature, "uses_pose", False) for p in parts)


def report_retreat(inquiry: RunAnalysis) -> Finding | None:
    """Report a camera that backed away, as it does for rotations about the optical axis."""
    depths, goal, turn = inquiry.depths, inquiry.goal_pose, inquiry.turn
    here = float(depths[0])
    if goal is not None:
        here = max(here, float(np.asarray(goal @ inquiry.sight.target.marks)[..., 2].mean()))
    farthest = float(np.nanmax(depths))
    if farthest < RETREAT_RATIO * here:
        return None
    evidence = {"from_m": float(depths[0]), "to_m": farthest}
    sentence = (
        f"The camera retreated: the marks were {format_number(depths[0])} m away at the start and "
    )
    sentence += (
        f"{format_number(farthest)} m at most{', farther than at the goal' if goal else ''}."
    )
    if turn is not None and abs(turn[2]) > LARGE_ROLL and not _is_position_based(inquiry):
        evidence["roll_deg"] = float(np.degrees(abs(turn[2])))
        sentence += (
            f" Start and goal differ by {format_angle(abs(turn[2]))} about the optical axis, and the "
            "straight ways that the law asks of the points make the camera back away "
            "(Chaumette 1998)."
        )
    return Finding("camera retreat", sentence, evidence)


def report_roll(inquiry: RunAnalysis) -> Finding | None:
    """Report a large rotation about the optical axis without a retreat."""
    turn = inquiry.turn
    if (
        turn is None
        or abs(turn[2]) < LARGE_ROLL
        or _is_position_based(inquiry)
        or report_retreat(inquiry)
    ):
        return None
    angle = abs(turn[2])
    sentence = (
        f"Start and goal differ by {format_angle(angle)} about the optical axis, far beyond the "
        "neighbourhood in which L describes how the points move."
    )
    return Finding("rotation about the axis", sentence, {"roll_deg": float(np.degrees(angle))})


def report_border(inquiry: RunAnalysis) -> Finding | None:
    """Report the image border where it is the only obstacle."""
    trial = inquiry.trial(remove_border)
    if trial is None or not trial.converged:
        return None
    sentence = (
        "Only the border of the image stands in the way: with an image without one the same run "
        f"{trial.ending}."
    )
    return Finding("border", sentence, {"converges_after_s": trial.end_time})


def report_joint_limit(inquiry: RunAnalysis) -> Finding | None:
    """Report whether the passed joint limit is the only obstacle."""
    name, side, limit, _, _ = find_passed_limit(inquiry)
    trial = inquiry.trial(remove_joint_limits)
    if trial is None:
        return None
    if trial.converged:
        end = f"without limits the same run {trial.ending}."
        return Finding(
            "joint limit",
            f"The {side} limit of {name} stands in the way, and nothing else: {end}",
            {"limit": limit, "converges_after_s": trial.end_time},
        )
    return Finding(
        "joint limit",
        f"The {side} limit of {name} is not the cause: without limits the run ends as "
        f"{trial.outcome.name} after {format_number(trial.end_time)} s.",
        {"limit": limit},
    )


def report_visibility(inquiry: RunAnalysis) -> Finding | None:
    """Report how few marks were in the image, and how well they determined the command."""
    marks = inquiry.diagnosis["marks_in_image"].values
    every = inquiry.controller.marks
    if not inquiry.controller.excused or marks.min() == every:
        return None
    conditions = inquiry.diagnosis["condition_task_jacobian"].values
    worst = float(np.nanmax(conditions)) if np.isfinite(conditions).any() else np.nan
    sentence = (
        f"Marks left the image or came into it: {marks[0]} of {every} were in it at the start, "
        f"{marks.min()} at least and {marks[-1]} at the end; the condition number of L J of those "
        f"that count was at most {format_number(worst)}."
    )
    return Finding("visibility", sentence, {"least_marks": float(marks.min()), "condition": worst})


def report_own_motion(inquiry: RunAnalysis) -> Finding | None:
    """Report robots that move on their own."""
    if not inquiry.case.scene.motions:
        return None
    return Finding("own motion", f"{format_moving_robots(inquiry.case.scene)} meanwhile.")


def report_near_border(inquiry: RunAnalysis) -> Finding | None:
    """Report a mark that came close to the border of its image."""
    margins = inquiry.diagnosis["border_margin"].values
    if inquiry.controller.excused or not np.isfinite(margins).any():
        return None
    t = int(np.nanargmin(margins))
    if margins[t] > 5 or t == 0:
        return None
    sentence = (
        f"A mark came within {format_number(margins[t])} px of the border of its image, after "
        f"{format_number(t * inquiry.case.dt)} s."
    )
    return Finding("near border", sentence, {"margin_px": float(margins[t])})
