"""Causes of marks that the detector of a task does not find in pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.detection_trials import PictureChange, detect_again, list_changes
from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_count
from robsim.servo.camera_target import CameraTarget
from robsim.vision.detectors.mark_detector import MarkDetector

EXAMINED = 12  # pictures over the run
SHARE = 0.5  # a change is a cause if it removes this share of the misses


def report_missed_marks(analysis: RunAnalysis) -> Finding | None:
    """Report marks that were not found in pictures, and the property of the pictures behind it."""
    for sight in analysis.controller.sights:
        detector = analysis.controller.detectors.get(sight.key)
        finding = None if detector is None else _examine_pair(analysis, sight, detector)
        if finding is not None:
            return finding
    return None


def _examine_pair(
    analysis: RunAnalysis, sight: CameraTarget, detector: MarkDetector
) -> Finding | None:
    """Return the finding on a camera and its target; None if every mark was found."""
    instants = np.unique(np.linspace(0, analysis.history.length - 1, EXAMINED).astype(int))
    misses = _count_misses(analysis, sight, PictureChange("", sight.eye, {}), detector, instants)
    if not misses:
        return None
    sentence = (
        f"{type(detector).__name__} missed marks of '{sight.target.name}' in "
        f"{misses} of {format_count(len(instants), 'examined picture')}"
    )
    evidence = {"pictures": float(len(instants)), "with_misses": float(misses)}
    if _count_backs(analysis, sight, instants) > SHARE * misses:
        text = f"{sentence}. The camera sees its back; the print is on the side of -z."
        return Finding("missed marks", text, evidence)
    best: tuple[int, PictureChange] | None = None
    for change in list_changes(sight.eye):
        left = _count_misses(analysis, sight, change, detector, instants)
        if best is None or left < best[0]:
            best = left, change
    if best is None or best[0] > SHARE * misses:
        return Finding("missed marks", f"{sentence}.", evidence)
    left, change = best
    found = "in none" if left == 0 else f"in {left}"
    text = f"{sentence}, and {found} of them {change.phrase}."
    return Finding("missed marks", text, {**evidence, "left": float(left)}, change.values)


def _count_backs(analysis: RunAnalysis, sight: CameraTarget, instants: NDArray[np.int64]) -> int:
    """Return the number of instants at which the camera sees the back of a printed target.

    The image of its marks is then mirrored: the affine map that is nearest to it has a negative
    determinant.
    """
    if sight.target.target is None:
        return 0
    marks = np.asarray(sight.target.marks)[:, :2]
    known = np.column_stack([marks, np.ones(len(marks))])
    pixels = analysis.history.state.projections[sight.key].pixels
    maps = [np.linalg.lstsq(known, pixels[..., t], rcond=None)[0][:2] for t in instants]
    return int(sum(np.linalg.det(each) < 0 for each in maps))


def _count_misses(
    analysis: RunAnalysis,
    sight: CameraTarget,
    change: PictureChange,
    detector: MarkDetector,
    instants: NDArray[np.int64],
) -> int:
    """Return the number of instants with marks in the image that the detector does not find."""
    found = detect_again(analysis, sight, change, detector, instants)
    return int(found.missed.any(axis=1).sum())
