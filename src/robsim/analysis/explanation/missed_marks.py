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
from robsim.rendering.light import Light
from robsim.robot.robot import Robot
from robsim.robot.tree import Tree
from robsim.servo.camera_target import CameraTarget
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch
from robsim.vision.optics import Optics
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene_picture import CameraPictures, NoiseKey, PicturedScene

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
    """Pictures without one cause of misses: a phrase, and the values of the change.

    `offset` (2,) is added to the pixels of a mark after their multiplication by `factor`. With
    `alone` the pictures show the target without other bodies.
    """

    phrase: str
    eye: MountedCamera
    values: dict[str, Raw]
    factor: float = 1.0
    offset: tuple[float, float] = (0.0, 0.0)
    alone: bool = False


class TargetAlone(NamedTuple):
    """A scene whose pictures show one object only."""

    objects: tuple[Object, ...]
    tree: Tree
    light: Light
    background: float
    robots: tuple[Robot, ...] = ()
    cameras: tuple[MountedCamera, ...] = ()


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
    misses = _count_misses(analysis, sight, PictureChange("", sight.eye, {}), detector, instants)
    if not misses:
        return None
    sentence = (
        f"{type(detector).__name__} missed marks of '{sight.target.name}' in "
        f"{misses} of {format_count(len(instants), 'examined picture')}"
    )
    evidence = {"pictures": float(len(instants)), "with_misses": float(misses)}
    best: tuple[int, PictureChange] | None = None
    for change in _list_changes(sight.eye):
        left = _count_misses(analysis, sight, change, detector, instants)
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
        if value != off and each.name in CAUSES:
            without = replace(optics, **{each.name: off})
            number = f"{each.name} = {format_number(value)}"
            path = f"cameras.{eye.name}.optics.{each.name}"
            phrase = f"without {CAUSES[each.name]} ({number})"
            yield PictureChange(phrase, replace(eye, optics=without), {path: off})
    yield PictureChange("without the other bodies, which hide marks", eye, {}, alone=True)
    width, height = eye.camera.size or (0, 0)
    K = eye.camera.K.copy()
    K[:2, 2] += width / 2, height / 2
    wider = replace(eye, camera=replace(eye.camera, K=K, size=(2 * width, 2 * height)))
    phrase = "with a larger image: its border cuts marks"
    yield PictureChange(phrase, wider, {}, offset=(width / 2, height / 2))
    larger = replace(eye, camera=eye.camera.resized(2 * width, 2 * height))
    phrase = "with twice the pixels along each side: the marks are too small in the image"
    yield PictureChange(phrase, larger, {}, factor=2.0, offset=(0.5, 0.5))


def _count_misses(
    analysis: RunAnalysis,
    sight: CameraTarget,
    change: PictureChange,
    detector: MarkDetector,
    instants: Array,
) -> int:
    """Return the number of instants with marks in the image that the detector does not find."""
    scene, loop, thing = sight.scene, analysis.loop, sight.target
    shown: PicturedScene = scene
    if change.alone:
        shown = TargetAlone((thing,), scene.tree, scene.light, scene.background)
    pictures = CameraPictures(shown, change.eye)
    believed = analysis.controller.believed_sights.get(sight.key, sight).eye.camera
    camera = believed if change.eye.camera is sight.eye.camera else change.eye.camera
    misses = 0
    for t in instants:
        now, before = analysis.snapshots[t], analysis.snapshots[max(t - 1, 0)]
        key = NoiseKey(loop.seed, loop.runs.astype(np.uint64), int(t))
        picture = pictures.take(now.q, (now.q - before.q) / loop.dt, key)
        view = now.projections[sight.key]
        true = change.factor * np.moveaxis(view.pixels, -1, 0) + change.offset
        search = MarkSearch(thing.target, np.asarray(thing.marks), camera, np.rint(true))
        inside = np.moveaxis(view.visibility == 0, -1, 0)
        misses += bool((np.isnan(detector.find(picture, search)).any(axis=-1) & inside).any())
    return misses
