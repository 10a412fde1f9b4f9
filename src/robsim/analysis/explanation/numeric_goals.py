"""Goals that are given as numbers: whether any pose has them."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.goal_search import STARTS
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length
from robsim.analysis.task_tree import list_servo_tasks
from robsim.servo.goals.goal import GoalFeatures


def report_unreachable_goal(inquiry: RunAnalysis) -> Finding | None:
    """Return the finding that no pose of the camera has the given features, or None."""
    nearest = inquiry.nearest
    if nearest is None or nearest.error < inquiry.tolerance:
        return None
    sentence = (
        "The goal is given as numbers, and no pose of the camera has them: of "
        f"{STARTS} searches from all around the target the best leaves an error of length "
        f"{inquiry.size(nearest.length)}, and the tolerance is {inquiry.size(inquiry.tolerance)}. "
        "Show the goal, or compute it from a pose."
    )
    return Finding(
        "unreachable goal", sentence, {"nearest": nearest.length, **_largest_features(inquiry)}
    )


def report_unseen_goal(inquiry: RunAnalysis) -> Finding | None:
    """Return the finding that the run did not reach given features, or None."""
    if not any(isinstance(leaf.goal, GoalFeatures) for leaf in list_servo_tasks(inquiry.case.task)):
        return None
    unreachable = report_unreachable_goal(inquiry)
    if unreachable:
        return unreachable
    sizes = _largest_features(inquiry)
    wanted, seen = (inquiry.size(sizes[name]) for name in ("goal", "start"))
    sentence = (
        f"The goal is given as numbers that no camera has seen: {_describe_nearest_pose(inquiry)}. The largest is "
        f"{wanted}, and at the start {seen}."
    )
    return Finding("goal", sentence, sizes)


def _describe_nearest_pose(inquiry: RunAnalysis) -> str:
    """Return a phrase on where the nearest pose with the given features is."""
    if inquiry.nearest is None:
        return "there may be no pose that has them"
    depth = format_length(float(inquiry.nearest.T_c_o.position[2]))
    if not inquiry.nearest.seen:
        return f"a pose that has them, {depth} in front of the target, does not see all marks"
    return f"a pose has them, {depth} in front of the target, and the run did not come there"


def _largest_features(inquiry: RunAnalysis) -> dict[str, float]:
    """Return the largest feature at the goal and at the start."""
    run = inquiry.run
    wanted, seen = (float(np.abs(s).max()) for s in (run["s_goal"].values, run["s"].values[0]))
    return {"goal": wanted, "start": seen}
