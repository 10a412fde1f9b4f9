"""A sentence on what happened and when, for each outcome of a run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_number, format_pixel, format_time
from robsim.engine.outcome import Outcome
from robsim.servo.camera_target import CameraTarget
from robsim.vision.camera import Visibility


def describe_run_end(inquiry: RunAnalysis) -> str:
    """Return a sentence that says how and when the run ended."""
    return _SENTENCES[inquiry.outcome](inquiry)


def _describe_convergence(inquiry: RunAnalysis) -> str:
    held = ", at the end of the run, " if inquiry.case.hold else " the run converged: "
    small = f"every error is below the tolerance of {inquiry.size(inquiry.tolerance)}."
    return format_time(inquiry.end) + held + small


def _describe_local_minimum(inquiry: RunAnalysis) -> str:
    return (
        f"{format_time(inquiry.end)} the robot stands still: no motion is commanded although the "
        f"largest error is {inquiry.size(inquiry.errors[-1])}, and the tolerance "
        f"{inquiry.size(inquiry.tolerance)}."
    )


def _describe_singularity(inquiry: RunAnalysis) -> str:
    controller = inquiry.controller
    rank = int(inquiry.value("rank_task_jacobian"))
    return (
        f"{format_time(inquiry.end)} the robot stands still in a singularity: L J has rank {rank}, and "
        f"{controller.full_rank} at the goal; the largest error is "
        f"{inquiry.size(inquiry.errors[-1])}."
    )


def _describe_out_of_image(inquiry: RunAnalysis) -> str:
    if inquiry.controller.excused:
        return f"{format_time(inquiry.end)} too few marks are left to command: {describe_marks_in_use(inquiry)}."
    sight, mark, place = find_lost_mark(inquiry, Visibility.OUT_OF_IMAGE)
    side = _name_image_side(sight, place)
    return (
        f"{format_time(inquiry.end)} mark {mark} of '{sight.target.name}' left the image of "
        f"'{sight.eye.name}' {side}, at pixel {format_pixel(place)}."
    )


def describe_marks_in_use(inquiry: RunAnalysis, t: int = -1) -> str:
    """Return how many marks are in the image at an instant, and of what rank L J is."""
    controller = inquiry.controller
    marks, rank = (int(inquiry.value(each, t)) for each in ("marks_in_image", "rank_task_jacobian"))
    return (
        f"{marks} of {controller.marks} are in the image, and L J of those that count has rank "
        f"{rank}, and {controller.full_rank} at the goal"
    )


def _name_image_side(sight: CameraTarget, place: np.ndarray) -> str:
    (left, right), (top, bottom) = sight.eye.camera.border
    sides = {
        "on the left": place[0] < left,
        "on the right": place[0] >= right,
        "at the top": place[1] < top,
        "at the bottom": place[1] >= bottom,
    }
    out = [side for side, beyond in sides.items() if beyond]
    return " and ".join(out) or "where its lens bends light no more"


def _describe_behind_camera(inquiry: RunAnalysis) -> str:
    sight, mark, _ = find_lost_mark(inquiry, Visibility.BEHIND_CAMERA)
    return f"{format_time(inquiry.end)} mark {mark} of '{sight.target.name}' came behind '{sight.eye.name}'."


def find_lost_mark(inquiry: RunAnalysis, flag: Visibility) -> tuple[CameraTarget, int, np.ndarray]:
    """Return the sight and the mark that is lost at the end, and its pixel."""
    projections = inquiry.snapshots[-1].projections
    for sight in inquiry.controller.sights:
        gone = np.flatnonzero(projections[sight.key].visibility[:, 0] == flag)
        if gone.size:
            mark = int(gone[0])
            return sight, mark, projections[sight.key].pixels[mark, :, 0]
    raise AssertionError(f"no mark is {flag.name}")


def _describe_joint_limit(inquiry: RunAnalysis) -> str:
    name, side, limit, unit, speed = find_passed_limit(inquiry)
    return (
        f"{format_time(inquiry.end)} {name} passed its {side} limit of {_format_limit_value(limit, unit)}, at "
        f"{_format_limit_value(speed, unit)} per second."
    )


def find_passed_limit(inquiry: RunAnalysis) -> tuple[str, str, float, str, float]:
    """Return the coordinate beyond a limit: its name, the side, the limit, unit and speed."""
    scene, last = inquiry.case.scene, inquiry.snapshots[-1]
    q, limits = last.q[:, 0], scene.limits
    below, above = limits[:, 0] - q, q - limits[:, 1]
    i = int(np.maximum(below, above).argmax())
    high = bool(above[i] > below[i])
    before = inquiry.snapshots[max(len(inquiry.snapshots) - 2, 0)].q[:, 0]
    speed = abs(float(q[i] - before[i])) / inquiry.case.dt
    side = "upper" if high else "lower"
    name, unit = scene.coordinate_names[i], scene.coordinate_units[i]
    return f"joint '{name}'", side, float(limits[i, int(high)]), unit, speed


def _format_limit_value(value: float, unit: str) -> str:
    return f"{np.degrees(value):.4g} degrees" if unit == "rad" else f"{format_number(value)} {unit}"


def _describe_divergence(inquiry: RunAnalysis) -> str:
    depths = inquiry.depths
    if depths[-1] > 10 * depths[0]:
        return (
            f"{format_time(inquiry.end)} the run diverged: the marks are {format_number(depths[-1])} m away, "
            f"and were {format_number(depths[0])} m away at the start."
        )
    return (
        f"{format_time(inquiry.end)} the run diverged: the largest error grew from "
        f"{inquiry.size(inquiry.errors[0])} to {inquiry.size(inquiry.errors[-1])}."
    )


def _describe_not_finite(inquiry: RunAnalysis) -> str:
    return f"{format_time(inquiry.end)} {name_not_finite(inquiry)} was not finite any more."


def name_not_finite(inquiry: RunAnalysis) -> str:
    """Return which quantity is not finite at the end."""
    last = inquiry.snapshots[-1]
    if not np.isfinite(last.q).all():
        return "the state"
    if not np.isfinite(last.command.error).all():
        return "a feature"
    return "the command"


def _describe_time_limit(inquiry: RunAnalysis) -> str:
    size = inquiry.size(inquiry.errors[-1])
    return (
        f"{format_time(inquiry.end)} the time was over: the largest error is {size} and "
        f"{_describe_trend(inquiry)}; the tolerance is {inquiry.size(inquiry.tolerance)}."
    )


def _describe_trend(inquiry: RunAnalysis) -> str:
    """Return how the error behaves in the last third of the run."""
    low, high = float(inquiry.late_errors.min()), float(inquiry.late_errors.max())
    if inquiry.falls:
        return f"falls by {format_number(100 * (1 - np.exp(-inquiry.decay)))} percent per second"
    if high < 1.02 * low:
        return "does not change any more"
    return f"goes up and down between {inquiry.size(low)} and {inquiry.size(high)}"


def _describe_stop(inquiry: RunAnalysis) -> str:
    return _describe_final_error(inquiry, "the run was stopped by the user")


def _describe_final_error(inquiry: RunAnalysis, why: str) -> str:
    """Return a sentence on a run that was ended, and its error then."""
    return (
        f"{format_time(inquiry.end)} {why}; the largest error was {inquiry.size(inquiry.errors[-1])} "
        f"then, and the tolerance is {inquiry.size(inquiry.tolerance)}."
    )


def _describe_reached_ending(inquiry: RunAnalysis) -> str:
    loop = inquiry.loop
    ending = loop.endings[int(loop.recorder.ending[0])]
    return _describe_final_error(inquiry, f"the run ended since {ending!r} held")


_SENTENCES: dict[Outcome, Callable[[RunAnalysis], str]] = {
    Outcome.RUNNING: _describe_stop,
    Outcome.CONVERGED: _describe_convergence,
    Outcome.LOCAL_MINIMUM: _describe_local_minimum,
    Outcome.OUT_OF_IMAGE: _describe_out_of_image,
    Outcome.BEHIND_CAMERA: _describe_behind_camera,
    Outcome.JOINT_LIMIT: _describe_joint_limit,
    Outcome.SINGULAR: _describe_singularity,
    Outcome.DIVERGED: _describe_divergence,
    Outcome.NOT_FINITE: _describe_not_finite,
    Outcome.TIME_LIMIT: _describe_time_limit,
    Outcome.ENDED: _describe_reached_ending,
}
