"""Causes of a run with features of pictures that does not reach its goal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.detection_trials import list_optics_changes
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_number
from robsim.base.arrays import Array
from robsim.servo.bound_block import BoundBlock
from robsim.servo.camera_target import CameraTarget
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene_picture import CameraPictures, NoiseKey

ALIKE = 0.9  # correlation of two pictures above which they show the same view
SHARE = 0.5  # an error of the optics is a cause if it makes this share of the difference
ILL_CONDITIONED = 1e3  # condition of the factor above which a motion hardly changes the picture
TWIST_WORDS = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")


def report_pictures(analysis: RunAnalysis) -> Iterator[Finding]:
    """Yield the findings on the pictures of the features of a run."""
    servo = analysis.servo
    if servo is None:
        return
    truths = {sight.key: sight for sight in servo.sights}
    for part in servo.bound_features.parts:
        if part.models_interaction:
            sight = truths[part.sights[0].key]
            yield from _report_unlike_goal(analysis, part, sight)
            yield from _report_weak_motion(analysis, part)


def _report_unlike_goal(
    analysis: RunAnalysis, part: BoundBlock, sight: CameraTarget
) -> Iterator[Finding]:
    """Yield the cause of a final picture that differs from the picture at the goal."""
    servo = analysis.servo
    assert servo is not None
    goal = servo.bound_features.goals[part.sights[0].key].pictures
    assert goal is not None
    shown = goal[0].astype(float)
    q_goal = servo.bound_features.q_goal
    if q_goal is not None:
        own = _find_own_difference(analysis, sight, shown, q_goal[:, :1])
        if own is not None:
            yield own
            return
    start, end = (
        compute_correlation(
            _draw_picture(analysis, sight, sight.eye, analysis.state(t).q, t), shown
        )
        for t in (0, analysis.history.length - 1)
    )
    if end < ALIKE:
        yield Finding(
            "basin",
            "The start is outside the basin of the difference of pictures: its picture agrees with "
            f"the goal with a correlation of {start:.2f}, and the last one with {end:.2f}.",
            {"start_correlation": start, "end_correlation": end},
        )


def _find_own_difference(
    analysis: RunAnalysis, sight: CameraTarget, shown: Array, q_goal: Array
) -> Finding | None:
    """Return the finding on a camera that does not see the goal picture even at its goal."""
    tolerance = analysis.controller.tolerance
    at_goal = _draw_picture(analysis, sight, sight.eye, q_goal)
    difference = compute_rms(at_goal - shown)
    if difference < tolerance:
        return None
    sentence = (
        f"Even at its goal the camera '{sight.eye.name}' would see a picture that differs from the "
        f"picture of the goal by {format_number(difference)} grey; the tolerance is "
        f"{format_number(tolerance)} grey"
    )
    for change in list_optics_changes(sight.eye):
        left = compute_rms(_draw_picture(analysis, sight, change.eye, q_goal) - shown)
        if left < SHARE * difference:
            text = f"{sentence}. It differs by {format_number(left)} grey {change.phrase}."
            return Finding("picture", text, {"difference": difference, "left": left}, change.values)
    text = f"{sentence}. The exposure, the light or the scene is another one."
    return Finding("picture", text, {"difference": difference})


def _report_weak_motion(analysis: RunAnalysis, part: BoundBlock) -> Iterator[Finding]:
    """Yield the motion of the camera that the picture at the goal determines least."""
    servo = analysis.servo
    assert servo is not None
    R = servo.bound_features.L_goals[servo.bound_features.parts.index(part)][:6, :, 0]
    _, sigma, motions = np.linalg.svd(R)
    condition = float(sigma[0] / sigma[-1]) if sigma[-1] > 0 else np.inf
    if condition > ILL_CONDITIONED:
        strongest = int(np.argmax(np.abs(motions[-1])))
        yield Finding(
            "texture",
            "The picture of the goal hardly changes with one motion, mainly "
            f"{TWIST_WORDS[strongest]} of the camera (condition {format_number(condition)}): its "
            "texture has no gradient for it.",
            {"condition": condition},
        )


def _draw_picture(
    analysis: RunAnalysis, sight: CameraTarget, eye: MountedCamera, q: Array, step: int = 0
) -> Array:
    """Return the grey values (h, w) at coordinates q (nq, 1), with noise and at rest."""
    key = NoiseKey(analysis.loop.seed, analysis.loop.runs.astype(np.uint64), step)
    picture: NDArray[np.uint8] = CameraPictures(sight.scene, eye).take(q, np.zeros_like(q), key)[0]
    return picture.astype(float)


def compute_rms(difference: Array) -> float:
    """Return the root mean square of a difference of pictures."""
    return float(np.sqrt(np.mean(difference**2)))


def compute_correlation(one: Array, other: Array) -> float:
    """Return the correlation of two pictures; 0 for a constant picture.

    >>> round(compute_correlation(np.array([[1.0, 2.0]]), np.array([[3.0, 7.0]])), 9)
    1.0
    """
    a, b = one - one.mean(), other - other.mean()
    size = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum()) / size if size > 0.0 else 0.0
