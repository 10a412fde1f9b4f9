"""Quality of the detection of marks in a run: misses with their reasons, bias and deviation."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.detection_trials import (
    DetectedMarks,
    PictureChange,
    detect_again,
    list_changes,
    list_optics_changes,
)
from robsim.analysis.resimulation import Resimulation
from robsim.base.arrays import Array
from robsim.servo.camera_target import CameraTarget
from robsim.vision.detectors.mark_detector import MarkDetector

MOST_PICTURES = 200  # of a camera and its target, of which the deviation is computed
MOST_TRIALS = 24  # of these, pictures that are drawn again without an error
OUTSIDE, UNKNOWN = "outside the image", "unknown"
Variables = dict[str, tuple[list[str], Any, dict[str, str]]]


class ExaminedPair(NamedTuple):
    """A camera and its target, their detector, and its marks at some instants."""

    sight: CameraTarget
    detector: MarkDetector
    instants: NDArray[np.int64]
    marks: DetectedMarks


def measure_detection(again: Resimulation) -> Variables:
    """Return the variables of detection of a run; none without a detector."""
    detectors = again.controller.detectors
    if not detectors:
        return {}
    count = again.history.length
    instants = np.unique(np.linspace(0, count - 1, MOST_PICTURES).round().astype(np.int64))
    pairs = []
    for sight in (each for each in again.controller.sights if each.key in detectors):
        own = detectors[sight.key], instants
        marks = detect_again(again, sight, PictureChange("", sight.eye, {}), *own)
        pairs.append(ExaminedPair(sight, *own, marks))
    deviation = np.concatenate([each.marks.deviation for each in pairs], axis=1)
    return {
        **_list_instants(pairs, deviation, count),
        **_measure_deviation(deviation),
        **_count_reasons(again, pairs),
        **_compare_optics(again, pairs),
    }


def _list_instants(pairs: list[ExaminedPair], deviation: Array, count: int) -> Variables:
    """Return misses and deviation over time, NaN at instants that were not examined."""
    instants = pairs[0].instants
    missed, error = np.full((2, count), np.nan)
    missed[instants] = sum(each.marks.missed.sum(axis=1) for each in pairs)
    error[instants] = [_compute_rms(each) for each in deviation]
    return {
        "marks_missed": (["time"], missed, {"units": "1", "long_name": "marks that are missed"}),
        "detection_error": (
            ["time"],
            error,
            {"units": "px", "long_name": "rms of detected minus true marks, along an axis"},
        ),
    }


def _measure_deviation(deviation: Array) -> Variables:
    """Return the number of pictures, and bias and rms of all marks that were found."""
    found = deviation[~np.isnan(deviation).any(axis=2)]
    bias = found.mean(axis=0) if len(found) else np.full(2, np.nan)
    about = {"units": "px", "long_name": "mean of detected minus true marks"}
    rms = {"units": "px", "long_name": "rms of detected minus true marks, along an axis"}
    pictures = {"units": "1", "long_name": "examined pictures"}
    return {
        "detection_pictures": ([], len(deviation), pictures),
        "detection_bias": (["axis"], bias, about),
        "detection_rms": ([], _compute_rms(found), rms),
    }


def _compute_rms(deviation: Array) -> float:
    """Return the root mean square of numbers that are not NaN; NaN without any."""
    numbers = deviation[np.isfinite(deviation)]
    return float(np.sqrt((numbers**2).mean())) if numbers.size else float("nan")


def _count_reasons(again: Resimulation, pairs: list[ExaminedPair]) -> Variables:
    """Return the numbers of marks that were not found, by reason.

    A mark in the image has the reason whose removal finds the most of the missed marks.
    """
    counts: dict[str, int] = {}
    for each in pairs:
        lost = np.isnan(each.marks.deviation).any(axis=2) & ~each.marks.visible
        counts[OUTSIDE] = counts.get(OUTSIDE, 0) + int(lost.sum())
        for reason, count in _explain_misses(again, each).items():
            counts[reason] = counts.get(reason, 0) + count
    about = {"units": "1", "long_name": "marks that were not found in the examined pictures"}
    used = {reason: count for reason, count in counts.items() if count}
    reasons = np.array(list(used), dtype=np.str_)
    return {
        "not_found": (["reason"], np.array(list(used.values()), dtype=np.int64), about),
        "reason": (["reason"], reasons, {"long_name": "pictures in which the marks are found"}),
    }


def _explain_misses(again: Resimulation, pair: ExaminedPair) -> dict[str, int]:
    """Return the numbers of missed marks of a pair by the phrases of changes that find them."""
    at = np.flatnonzero(pair.marks.missed.any(axis=1))
    at = at[np.unique(np.linspace(0, len(at) - 1, MOST_TRIALS).astype(int))] if len(at) else at
    left = pair.marks.missed[at]
    found = {}
    for change in list_changes(pair.sight.eye) if len(at) else ():
        marks = detect_again(again, pair.sight, change, pair.detector, pair.instants[at])
        found[change.phrase] = left & ~np.isnan(marks.deviation).any(axis=2)
    counts = {}
    for phrase, repaired in sorted(found.items(), key=lambda each: -int(each[1].sum())):
        counts[phrase] = int((repaired & left).sum())
        left = left & ~repaired
    examined = int(pair.marks.missed[at].sum())
    missed = int(pair.marks.missed.sum())
    return {**counts, UNKNOWN: int(left.sum()), "not examined": missed - examined}


def _compare_optics(again: Resimulation, pairs: list[ExaminedPair]) -> Variables:
    """Return the rms of the deviation without each error of the optics."""
    squares: dict[str, list[Array]] = {}
    for each in pairs:
        some = each.instants[:: max(len(each.instants) // MOST_TRIALS, 1)]
        for change in list_optics_changes(each.sight.eye):
            marks = detect_again(again, each.sight, change, each.detector, some)
            squares.setdefault(change.field, []).append(marks.deviation.ravel())
    rms = [_compute_rms(np.concatenate(each)) for each in squares.values()]
    about = {"units": "px", "long_name": "detection_rms without one error of the optics"}
    return {
        "detection_rms_without": (["optics"], np.array(rms, dtype=np.float64), about),
        "optics": (["optics"], np.array(list(squares), dtype=np.str_), {"long_name": "field"}),
    }
