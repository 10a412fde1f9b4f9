"""A sentence on the end of a run, for each outcome."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_number, format_pixel, format_time
from robsim.engine.outcome import Outcome
from robsim.servo.camera_target import CameraTarget
from robsim.vision.camera import Visibility


def describe_run_end(analysis: RunAnalysis) -> str:
    """Return a sentence on how and when the run ended."""
    return _SENTENCES[analysis.outcome](analysis)


def _describe_convergence(analysis: RunAnalysis) -> str:
    held = ", at the end of the run, " if analysis.case.hold else " the run converged: "
    small = f"every error is below the tolerance of {analysis.size(analysis.tolerance)}."
    return format_time(analysis.end) + held + small


def _describe_local_minimum(analysis: RunAnalysis) -> str:
    return (
        f"{format_time(analysis.end)} the robot stands still: no motion is commanded although the "
        f"largest error is {analysis.size(analysis.errors[-1])}, and the tolerance "
        f"{analysis.size(analysis.tolerance)}."
    )


def _describe_singularity(analysis: RunAnalysis) -> str:
    controller = analysis.controller
    rank = int(analysis.value("rank_task_jacobian"))
    return (
        f"{format_time(analysis.end)} the robot stands still in a singularity: L J has rank "
        f"{rank}, and {controller.full_rank} at the goal; the largest error is "
        f"{analysis.size(analysis.errors[-1])}."
    )


def _describe_out_of_image(analysis: RunAnalysis) -> str:
    if analysis.controller.optional_pairs:
        marks = describe_marks_in_use(analysis)
        return f"{format_time(analysis.end)} too few marks are left for a command: {marks}."
    sight, mark, place = find_lost_mark(analysis, Visibility.OUT_OF_IMAGE)
    side = _name_image_side(sight, place)
    return (
        f"{format_time(analysis.end)} mark {mark} of '{sight.target.name}' left the image of "
        f"'{sight.eye.name}' {side}, at pixel {format_pixel(place)}."
    )


def describe_marks_in_use(analysis: RunAnalysis, t: int = -1) -> str:
    """Return the number of marks in the image at an instant, and the rank of L J."""
    controller = analysis.controller
    marks, rank = (
        int(analysis.value(each, t)) for each in ("marks_in_image", "rank_task_jacobian")
    )
    return (
        f"{marks} of {controller.marks} are in the image, and L J of the counted marks has rank "
        f"{rank}, and {controller.full_rank} at the goal"
    )


def _name_image_side(sight: CameraTarget, place: np.ndarray) -> str:
    """Return the side of the image that a pixel is beyond."""
    (left, right), (top, bottom) = sight.eye.camera.border
    sides = {
        "on the left": place[0] < left,
        "on the right": place[0] >= right,
        "at the top": place[1] < top,
        "at the bottom": place[1] >= bottom,
    }
    names = [side for side, beyond in sides.items() if beyond]
    return " and ".join(names) or "beyond the range of its lens model"


def _describe_behind_camera(analysis: RunAnalysis) -> str:
    sight, mark, _ = find_lost_mark(analysis, Visibility.BEHIND_CAMERA)
    target, camera = sight.target.name, sight.eye.name
    return f"{format_time(analysis.end)} mark {mark} of '{target}' came behind '{camera}'."


def find_lost_mark(analysis: RunAnalysis, flag: Visibility) -> tuple[CameraTarget, int, np.ndarray]:
    """Return the camera-target pair and the mark that is lost at the end, and its pixel."""
    projections = analysis.last_state.projections
    for sight in analysis.controller.sights:
        lost = np.flatnonzero(projections[sight.key].visibility[:, 0] == flag)
        if lost.size:
            mark = int(lost[0])
            return sight, mark, projections[sight.key].pixels[mark, :, 0]
    raise AssertionError(f"no mark is {flag.name}")


def _describe_joint_limit(analysis: RunAnalysis) -> str:
    name, side, limit, unit, speed = find_passed_limit(analysis)
    return (
        f"{format_time(analysis.end)} {name} passed its {side} limit of "
        f"{_format_limit_value(limit, unit)}, at {_format_limit_value(speed, unit)} per second."
    )


def find_passed_limit(analysis: RunAnalysis) -> tuple[str, str, float, str, float]:
    """Return the coordinate beyond a limit: its name, side, limit, unit and speed."""
    scene, last = analysis.case.scene, analysis.last_state
    q, limits = last.q[:, 0], scene.limits
    below, above = limits[:, 0] - q, q - limits[:, 1]
    i = int(np.maximum(below, above).argmax())
    high = bool(above[i] > below[i])
    before = analysis.q[:, max(analysis.history.length - 2, 0)]
    speed = abs(float(q[i] - before[i])) / analysis.case.dt
    side = "upper" if high else "lower"
    name, unit = scene.coordinate_names[i], scene.coordinate_units[i]
    return f"joint '{name}'", side, float(limits[i, int(high)]), unit, speed


def _format_limit_value(value: float, unit: str) -> str:
    """Return a coordinate with its unit, angles in degrees."""
    return f"{np.degrees(value):.4g} degrees" if unit == "rad" else f"{format_number(value)} {unit}"


def _describe_divergence(analysis: RunAnalysis) -> str:
    depths = analysis.depths
    if depths[-1] > 10 * depths[0]:
        return (
            f"{format_time(analysis.end)} the run diverged: the depth of the marks is "
            f"{format_number(depths[-1])} m, and was {format_number(depths[0])} m at the start."
        )
    return (
        f"{format_time(analysis.end)} the run diverged: the largest error grew from "
        f"{analysis.size(analysis.errors[0])} to {analysis.size(analysis.errors[-1])}."
    )


def _describe_not_finite(analysis: RunAnalysis) -> str:
    return f"{format_time(analysis.end)} {name_not_finite(analysis)} was not finite any more."


def name_not_finite(analysis: RunAnalysis) -> str:
    """Return the name of the quantity that is not finite at the end."""
    last = analysis.last_state
    if not np.isfinite(last.q).all():
        return "the state"
    if not np.isfinite(last.command.error).all():
        return "a feature"
    return "the command"


def _describe_time_limit(analysis: RunAnalysis) -> str:
    size = analysis.size(analysis.errors[-1])
    return (
        f"{format_time(analysis.end)} the time was over: the largest error is {size} and "
        f"{_describe_trend(analysis)}; the tolerance is {analysis.size(analysis.tolerance)}."
    )


def _describe_trend(analysis: RunAnalysis) -> str:
    """Return the trend of the error in the last third of the run."""
    low, high = float(analysis.late_errors.min()), float(analysis.late_errors.max())
    if analysis.is_falling:
        return f"falls by {format_number(100 * (1 - np.exp(-analysis.decay)))} percent per second"
    if high < 1.02 * low:
        return "does not change any more"
    return f"goes up and down between {analysis.size(low)} and {analysis.size(high)}"


def _describe_stop(analysis: RunAnalysis) -> str:
    return _describe_final_error(analysis, "the run was stopped by the user")


def _describe_final_error(analysis: RunAnalysis, why: str) -> str:
    """Return a sentence on a run that was ended, with its final error."""
    return (
        f"{format_time(analysis.end)} {why}; the largest error was "
        f"{analysis.size(analysis.errors[-1])} then, and the tolerance is "
        f"{analysis.size(analysis.tolerance)}."
    )


def _describe_reached_ending(analysis: RunAnalysis) -> str:
    loop = analysis.loop
    ending = loop.endings[int(loop.recorder.ending[0])]
    return _describe_final_error(analysis, f"the run ended because {ending!r} held")


def _describe_undetected_start(analysis: RunAnalysis) -> str:
    names = {type(each).__name__ for each in analysis.controller.detectors.values()}
    return f"{' and '.join(sorted(names))} did not find every mark in the first picture."


def _describe_empty_picture(analysis: RunAnalysis) -> str:
    last = "The last picture" if analysis.loop.recorder.end_step[0] else "The first picture"
    return f"{last} has hardly any contrast: the scene of the goal is not in view."


def _describe_flat_picture(analysis: RunAnalysis) -> str:
    last = "The last picture" if analysis.loop.recorder.end_step[0] else "The first picture"
    return f"{last} has no gradient, so that no motion of the camera changes it."


def _describe_instability(analysis: RunAnalysis) -> str:
    return f"{format_time(analysis.end)} the speed of a joint exploded: the joints are unstable."


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
    Outcome.UNDETECTED: _describe_undetected_start,
    Outcome.NO_GRADIENT: _describe_flat_picture,
    Outcome.NOTHING_IN_VIEW: _describe_empty_picture,
    Outcome.UNSTABLE: _describe_instability,
}
