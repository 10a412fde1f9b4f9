"""Reports on goals that are given as numbers, which may have no pose."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.goal_search import STARTS
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length
from robsim.analysis.task_tree import list_servo_tasks
from robsim.servo.goals.goal import GoalFeatures


def report_unreachable_goal(analysis: RunAnalysis) -> Finding | None:
    """Report that no pose of the camera has the given features; else None."""
    nearest = analysis.nearest
    if nearest is None or nearest.error < analysis.tolerance:
        return None
    sentence = (
        "The goal is given as numbers, and no pose of the camera has them: of "
        f"{STARTS} searches around the target the best leaves an error of length "
        f"{analysis.size(nearest.length)}, and the tolerance is "
        f"{analysis.size(analysis.tolerance)}. "
        "Show the goal, or compute it from a pose."
    )
    return Finding(
        "unreachable goal", sentence, {"nearest": nearest.length, **_largest_features(analysis)}
    )


def report_unseen_goal(analysis: RunAnalysis) -> Finding | None:
    """Report that the run did not reach the given features; None for other goals."""
    if not any(
        isinstance(leaf.goal, GoalFeatures) for leaf in list_servo_tasks(analysis.case.task)
    ):
        return None
    unreachable = report_unreachable_goal(analysis)
    if unreachable:
        return unreachable
    sizes = _largest_features(analysis)
    at_goal, at_start = (analysis.size(sizes[name]) for name in ("goal", "start"))
    sentence = (
        f"The goal is given as numbers, without an image: {_describe_nearest_pose(analysis)}. "
        f"The largest is {at_goal}, and at the start {at_start}."
    )
    return Finding("goal", sentence, sizes)


def _describe_nearest_pose(analysis: RunAnalysis) -> str:
    """Return a phrase on the nearest pose with the given features."""
    if analysis.nearest is None:
        return "there may be no pose that has them"
    depth = format_length(float(analysis.nearest.T_c_o.position[2]))
    if not analysis.nearest.is_in_image:
        return f"a pose that has them, {depth} in front of the target, does not see all marks"
    return f"a pose has them, {depth} in front of the target, and the run did not come there"


def _largest_features(analysis: RunAnalysis) -> dict[str, float]:
    """Return the largest feature at the goal and at the start."""
    run = analysis.run
    at_goal, at_start = (float(np.abs(s).max()) for s in (run["s_goal"].values, run["s"].values[0]))
    return {"goal": at_goal, "start": at_start}
