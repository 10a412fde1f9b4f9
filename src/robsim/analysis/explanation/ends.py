"""A sentence on what happened and when, for each outcome of a run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import number, pixel, when
from robsim.engine.outcome import Outcome
from robsim.servo.sight import Sight
from robsim.vision.camera import Visibility


def what_happened(inquiry: Inquiry) -> str:
    """Return a sentence that says how and when the run ended."""
    return _SENTENCES[inquiry.outcome](inquiry)


def _converged(inquiry: Inquiry) -> str:
    held = ", at the end of the run, " if inquiry.case.hold else " the run converged: "
    small = f"every error is below the tolerance of {inquiry.size(inquiry.tolerance)}."
    return when(inquiry.end) + held + small


def _local_minimum(inquiry: Inquiry) -> str:
    return (
        f"{when(inquiry.end)} the robot stands still: no motion is commanded although the "
        f"largest error is {inquiry.size(inquiry.errors[-1])}, and the tolerance "
        f"{inquiry.size(inquiry.tolerance)}."
    )


def _singular(inquiry: Inquiry) -> str:
    controller = inquiry.controller
    rank = int(inquiry.value("rank_task_jacobian"))
    return (
        f"{when(inquiry.end)} the robot stands still in a singularity: L J has rank {rank}, and "
        f"{controller.full_rank} at the goal; the largest error is "
        f"{inquiry.size(inquiry.errors[-1])}."
    )


def _out_of_image(inquiry: Inquiry) -> str:
    if inquiry.controller.excused:
        return f"{when(inquiry.end)} too few marks are left to command: {in_use(inquiry)}."
    sight, mark, place = lost_mark(inquiry, Visibility.OUT_OF_IMAGE)
    side = _side(sight, place)
    return (
        f"{when(inquiry.end)} mark {mark} of '{sight.target.name}' left the image of "
        f"'{sight.eye.name}' {side}, at pixel {pixel(place)}."
    )


def in_use(inquiry: Inquiry, t: int = -1) -> str:
    """Return how many marks are in the image at an instant, and of what rank L J is."""
    controller = inquiry.controller
    marks, rank = (int(inquiry.value(each, t)) for each in ("marks_in_image", "rank_task_jacobian"))
    return (
        f"{marks} of {controller.marks} are in the image, and L J of those that count has rank "
        f"{rank}, and {controller.full_rank} at the goal"
    )


def _side(sight: Sight, place: np.ndarray) -> str:
    (left, right), (top, bottom) = sight.eye.camera.border
    sides = {
        "on the left": place[0] < left,
        "on the right": place[0] >= right,
        "at the top": place[1] < top,
        "at the bottom": place[1] >= bottom,
    }
    out = [side for side, beyond in sides.items() if beyond]
    return " and ".join(out) or "where its lens bends light no more"


def _behind(inquiry: Inquiry) -> str:
    sight, mark, _ = lost_mark(inquiry, Visibility.BEHIND_CAMERA)
    return (
        f"{when(inquiry.end)} mark {mark} of '{sight.target.name}' came behind '{sight.eye.name}'."
    )


def lost_mark(inquiry: Inquiry, flag: Visibility) -> tuple[Sight, int, np.ndarray]:
    """Return the sight and the mark that is lost at the end, and its pixel."""
    projections = inquiry.snapshots[-1].projections
    for sight in inquiry.controller.sights:
        gone = np.flatnonzero(projections[sight.key].visibility[:, 0] == flag)
        if gone.size:
            mark = int(gone[0])
            return sight, mark, projections[sight.key].pixels[mark, :, 0]
    raise AssertionError(f"no mark is {flag.name}")


def _joint_limit(inquiry: Inquiry) -> str:
    name, side, limit, unit, speed = beyond_limit(inquiry)
    return (
        f"{when(inquiry.end)} {name} passed its {side} limit of {_in_unit(limit, unit)}, at "
        f"{_in_unit(speed, unit)} per second."
    )


def beyond_limit(inquiry: Inquiry) -> tuple[str, str, float, str, float]:
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


def _in_unit(value: float, unit: str) -> str:
    return f"{np.degrees(value):.4g} degrees" if unit == "rad" else f"{number(value)} {unit}"


def _diverged(inquiry: Inquiry) -> str:
    depths = inquiry.depths
    if depths[-1] > 10 * depths[0]:
        return (
            f"{when(inquiry.end)} the run diverged: the marks are {number(depths[-1])} m away, "
            f"and were {number(depths[0])} m away at the start."
        )
    return (
        f"{when(inquiry.end)} the run diverged: the largest error grew from "
        f"{inquiry.size(inquiry.errors[0])} to {inquiry.size(inquiry.errors[-1])}."
    )


def _not_finite(inquiry: Inquiry) -> str:
    return f"{when(inquiry.end)} {not_finite(inquiry)} was not finite any more."


def not_finite(inquiry: Inquiry) -> str:
    """Return which quantity is not finite at the end."""
    last = inquiry.snapshots[-1]
    if not np.isfinite(last.q).all():
        return "the state"
    if not np.isfinite(last.command.error).all():
        return "a feature"
    return "the command"


def _time_limit(inquiry: Inquiry) -> str:
    size = inquiry.size(inquiry.errors[-1])
    return (
        f"{when(inquiry.end)} the time was over: the largest error is {size} and "
        f"{_course(inquiry)}; the tolerance is {inquiry.size(inquiry.tolerance)}."
    )


def _course(inquiry: Inquiry) -> str:
    """Return how the error behaves in the last third of the run."""
    low, high = float(inquiry.late_errors.min()), float(inquiry.late_errors.max())
    if inquiry.falls:
        return f"falls by {number(100 * (1 - np.exp(-inquiry.decay)))} percent per second"
    if high < 1.02 * low:
        return "does not change any more"
    return f"goes up and down between {inquiry.size(low)} and {inquiry.size(high)}"


def _running(inquiry: Inquiry) -> str:
    return _until(inquiry, "the run was stopped by the user")


def _until(inquiry: Inquiry, why: str) -> str:
    """Return a sentence on a run that was ended, and its error then."""
    return (
        f"{when(inquiry.end)} {why}; the largest error was {inquiry.size(inquiry.errors[-1])} "
        f"then, and the tolerance is {inquiry.size(inquiry.tolerance)}."
    )


def _ended(inquiry: Inquiry) -> str:
    loop = inquiry.loop
    ending = loop.endings[int(loop.recorder.ending[0])]
    return _until(inquiry, f"the run ended since {ending!r} held")


_SENTENCES: dict[Outcome, Callable[[Inquiry], str]] = {
    Outcome.RUNNING: _running,
    Outcome.CONVERGED: _converged,
    Outcome.LOCAL_MINIMUM: _local_minimum,
    Outcome.OUT_OF_IMAGE: _out_of_image,
    Outcome.BEHIND_CAMERA: _behind,
    Outcome.JOINT_LIMIT: _joint_limit,
    Outcome.SINGULAR: _singular,
    Outcome.DIVERGED: _diverged,
    Outcome.NOT_FINITE: _not_finite,
    Outcome.TIME_LIMIT: _time_limit,
    Outcome.ENDED: _ended,
}
