"""Reasons for an outcome that are read from the diagnosis, rather than found by removal."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from robsim.analysis.explanation.departures import (
    blind_start,
    border_alone,
    came_and_went,
    limit_alone,
    near_border,
    own_motion,
    pose_features,
    retreat,
    roll,
)
from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.given_goals import unreachable_goal, unseen_goal
from robsim.analysis.explanation.growth import growing, loop_gain, misled, singular_feature
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.lateness import lagging, slow, steering
from robsim.analysis.explanation.stalls import (
    ascending,
    camera_law,
    lost_direction,
    null_space,
    own_law,
)
from robsim.engine.outcome import Outcome

Reason = Callable[[Inquiry], Finding | None]


def reasons(inquiry: Inquiry) -> Iterator[Finding]:
    """Yield the findings for the run's outcome, most important first."""
    start = blind_start(inquiry) if inquiry.outcome in _LOST else None
    if start:
        yield start
        return
    unreachable = unreachable_goal(inquiry) if inquiry.outcome in _UNDECIDED else None
    if unreachable:
        yield unreachable
        return
    for reason in _REASONS[inquiry.outcome]:
        finding = reason(inquiry)
        if finding:
            yield finding
            if "converges_after_s" in finding.evidence:
                return  # nothing else stands in the way


_UNDECIDED = (Outcome.LOCAL_MINIMUM, Outcome.TIME_LIMIT)  # as all end that cannot arrive
_LOST = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA)
_WILD = (loop_gain, pose_features, ascending, retreat, roll, misled, own_motion, unseen_goal)
_REASONS: dict[Outcome, tuple[Reason, ...]] = {
    Outcome.RUNNING: (),
    Outcome.ENDED: (),
    Outcome.CONVERGED: (came_and_went, retreat, near_border),
    Outcome.LOCAL_MINIMUM: (camera_law, null_space, own_law, unseen_goal, came_and_went),
    Outcome.OUT_OF_IMAGE: (*_WILD, border_alone, growing, came_and_went),
    Outcome.BEHIND_CAMERA: (*_WILD, growing),
    Outcome.JOINT_LIMIT: (loop_gain, ascending, misled, limit_alone, retreat, roll, own_motion),
    Outcome.SINGULAR: (lost_direction, came_and_went),
    Outcome.DIVERGED: (loop_gain, ascending, retreat, roll, misled, unseen_goal, growing),
    Outcome.NOT_FINITE: (singular_feature, loop_gain, misled, growing),
    Outcome.TIME_LIMIT: (
        *(slow, steering, ascending, loop_gain, misled, retreat, unseen_goal, lagging),
        came_and_went,
    ),
}
