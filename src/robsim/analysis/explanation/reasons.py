"""Causes of an outcome that follow from the diagnosis, without trial runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from robsim.analysis.explanation.active_constraints import report_constraints
from robsim.analysis.explanation.divergence import (
    report_growing_error,
    report_loop_gain,
    report_not_finite,
    report_wrong_interaction,
)
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.goal_motion import report_missing_motion, report_sideways_goal
from robsim.analysis.explanation.lost_targets import (
    report_blind_start,
    report_border,
    report_joint_limit,
    report_near_border,
    report_own_motion,
    report_pose_features,
    report_retreat,
    report_roll,
    report_visibility,
)
from robsim.analysis.explanation.missed_marks import report_missed_marks
from robsim.analysis.explanation.numeric_goals import report_unreachable_goal, report_unseen_goal
from robsim.analysis.explanation.picture_differences import report_pictures
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.slow_convergence import (
    report_slow_decay,
    report_standing_error,
    report_steering,
)
from robsim.analysis.explanation.standstill import (
    report_ascent,
    report_camera_law,
    report_lost_direction,
    report_null_space,
    report_own_law,
)
from robsim.analysis.explanation.workspace_search import report_out_of_reach
from robsim.engine.outcome import Outcome

ReasonReporter = Callable[[RunAnalysis], Finding | None]


def generate_reasons(analysis: RunAnalysis) -> Iterator[Finding]:
    """Yield the findings for the run's outcome, most important first."""
    missed = report_missed_marks(analysis)
    if missed:
        yield missed
    if analysis.outcome is not Outcome.CONVERGED:
        yield from report_pictures(analysis)
    start = report_blind_start(analysis) if analysis.outcome in _TARGET_LOST else None
    if start:
        yield start
        return
    unreachable = report_unreachable_goal(analysis) if analysis.outcome in _UNREACHED else None
    if unreachable:
        yield unreachable
        return
    distant = report_out_of_reach(analysis) if analysis.outcome in _OUT_OF_REACH else None
    if distant:
        yield distant
        if analysis.outcome is not Outcome.LOCAL_MINIMUM:
            return
    drive_reasons = _list_drive_reasons(analysis)
    for reason in (*drive_reasons, *_REASONS[analysis.outcome]):
        finding = reason(analysis)
        if finding:
            yield finding
            if "converges_after_s" in finding.evidence:
                return  # there is no other obstacle


def _list_drive_reasons(analysis: RunAnalysis) -> tuple[ReasonReporter, ...]:
    """Return the reporters of causes in driven joints; none without a drive."""
    if analysis.loop.driven is None:
        return ()
    from robsim.analysis.explanation import drive_reasons

    if analysis.outcome is Outcome.CONVERGED:
        return (drive_reasons.report_saturation,)
    return (
        drive_reasons.report_unstable_drive,
        drive_reasons.report_drive_gain,
        drive_reasons.report_friction,
    )


_UNREACHED = (Outcome.LOCAL_MINIMUM, Outcome.TIME_LIMIT)  # outcomes of runs to an unreachable goal
# outcomes of runs to a goal beyond the workspace
_OUT_OF_REACH = (*_UNREACHED, Outcome.JOINT_LIMIT, Outcome.SINGULAR, Outcome.DIVERGED)
_TARGET_LOST = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA)
_COMMON_REASONS = (
    report_loop_gain,
    report_sideways_goal,
    report_pose_features,
    report_ascent,
    report_retreat,
    report_roll,
    report_wrong_interaction,
    report_own_motion,
    report_unseen_goal,
)
_REASONS: dict[Outcome, tuple[ReasonReporter, ...]] = {
    Outcome.RUNNING: (),
    Outcome.ENDED: (),
    Outcome.UNDETECTED: (),
    Outcome.NO_GRADIENT: (),
    Outcome.NOTHING_IN_VIEW: (),
    Outcome.UNSTABLE: (),
    Outcome.CONVERGED: (report_visibility, report_retreat, report_near_border),
    Outcome.LOCAL_MINIMUM: (
        report_camera_law,
        report_constraints,
        report_null_space,
        report_own_law,
        report_missing_motion,
        report_unseen_goal,
        report_visibility,
    ),
    Outcome.OUT_OF_IMAGE: (
        report_constraints,
        *_COMMON_REASONS,
        report_border,
        report_growing_error,
        report_visibility,
    ),
    Outcome.BEHIND_CAMERA: (*_COMMON_REASONS, report_growing_error),
    Outcome.JOINT_LIMIT: (
        report_loop_gain,
        report_ascent,
        report_wrong_interaction,
        report_joint_limit,
        report_sideways_goal,
        report_retreat,
        report_roll,
        report_own_motion,
    ),
    Outcome.SINGULAR: (report_lost_direction, report_visibility),
    Outcome.DIVERGED: (
        report_loop_gain,
        report_ascent,
        report_retreat,
        report_roll,
        report_wrong_interaction,
        report_unseen_goal,
        report_growing_error,
    ),
    Outcome.NOT_FINITE: (
        report_not_finite,
        report_loop_gain,
        report_wrong_interaction,
        report_growing_error,
    ),
    Outcome.TIME_LIMIT: (
        *(
            report_constraints,
            report_slow_decay,
            report_steering,
            report_ascent,
            report_loop_gain,
            report_wrong_interaction,
            report_retreat,
            report_unseen_goal,
            report_standing_error,
            report_missing_motion,
        ),
        report_visibility,
    ),
}
