"""Causes of marks that the detector of a task does not find in pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_count, format_number
from robsim.base.arrays import Array
from robsim.declare import fields_of
from robsim.declare.spec import Raw
from robsim.servo.camera_target import CameraTarget
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch
from robsim.vision.optics import Optics
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene_picture import CameraPictures, NoiseKey, PictureBodies

EXAMINED = 12  # pictures over the run
SHARE = 0.5  # a change is a cause if it removes this share of the misses
CAUSES = {
    "full_well": "shot noise",
    "read_noise": "read noise",
    "defocus": "the blur of the lens",
    "vignetting": "vignetting",
    "exposure": "the blur by motion",
    "readout": "the rolling shutter",
    "gain": "the gain",
    "gamma": "gamma",
    "bits": "the few grey levels",
}


class PictureChange(NamedTuple):
    """A camera without one cause of misses: a phrase, and the values of the change."""

    phrase: str
    eye: MountedCamera
    values: dict[str, Raw]


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
    instants = np.unique(np.linspace(0, len(analysis.snapshots) - 1, EXAMINED).astype(int))
    misses = _count_misses(analysis, sight, sight.eye, detector, instants)
    if not misses:
        return None
    sentence = (
        f"{type(detector).__name__} missed marks of '{sight.target.name}' in "
        f"{misses} of {format_count(len(instants), 'examined picture')}"
    )
    evidence = {"pictures": float(len(instants)), "with_misses": float(misses)}
    best: tuple[int, PictureChange] | None = None
    for change in _list_changes(sight.eye):
        left = _count_misses(analysis, sight, change.eye, detector, instants)
        if best is None or left < best[0]:
            best = left, change
    if best is None or best[0] > SHARE * misses:
        return Finding("missed marks", f"{sentence}.", evidence)
    left, change = best
    found = "in none" if left == 0 else f"in {left}"
    text = f"{sentence}, and {found} of them {change.phrase}."
    return Finding("missed marks", text, {**evidence, "left": float(left)}, change.values)


def _list_changes(eye: MountedCamera) -> Iterator[PictureChange]:
    """Yield the cameras without one error of the optics, and with twice the pixels."""
    optics = Optics() if eye.optics is None else eye.optics
    for each in fields_of(Optics):
        value, off = vars(optics)[each.name], each.default
        if value != off:
            without = replace(optics, **{each.name: off})
            number = f"{each.name} = {format_number(value)}"
            path = f"cameras.{eye.name}.optics.{each.name}"
            phrase = f"without {CAUSES[each.name]} ({number})"
            yield PictureChange(phrase, replace(eye, optics=without), {path: off})
    width, height = eye.camera.size or (0, 0)
    larger = replace(eye, camera=eye.camera.resized(2 * width, 2 * height))
    phrase = "with twice the pixels along each side: the marks are too small in the image"
    yield PictureChange(phrase, larger, {})


def _count_misses(
    analysis: RunAnalysis,
    sight: CameraTarget,
    eye: MountedCamera,
    detector: MarkDetector,
    instants: Array,
) -> int:
    """Return the number of instants with marks in the image that the detector does not find."""
    scene, loop = sight.scene, analysis.loop
    pictures = CameraPictures(
        PictureBodies(scene.robots, scene.objects, scene.cameras, scene.tree), eye
    )
    factor = (eye.camera.size or (1,))[0] / (sight.eye.camera.size or (1,))[0]
    misses = 0
    for t in instants:
        now, before = analysis.snapshots[t], analysis.snapshots[max(t - 1, 0)]
        key = NoiseKey(loop.seed, loop.runs.astype(np.uint64), int(t))
        picture = pictures.take(now.q, (now.q - before.q) / loop.dt, key)
        view = now.projections[sight.key]
        true = np.moveaxis(factor * (view.pixels + 0.5) - 0.5, -1, 0)
        thing = sight.target
        search = MarkSearch(
            thing.target, np.asarray(thing.marks), eye.camera, np.rint(true), int(t)
        )
        inside = np.moveaxis(view.visibility == 0, -1, 0)
        misses += bool((np.isnan(detector.find(picture, search)).any(axis=-1) & inside).any())
    return misses
