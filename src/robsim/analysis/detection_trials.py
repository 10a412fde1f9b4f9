"""Detection in the pictures of a run, drawn again with and without one of their errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.resimulation import Resimulation
from robsim.base.arrays import Array
from robsim.declare import fields_of
from robsim.declare.context import Raw
from robsim.rendering.light import Light
from robsim.robot.robot import Robot
from robsim.robot.tree import Tree
from robsim.servo.camera_target import CameraTarget
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch
from robsim.vision.optics import Optics
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene_picture import CameraPictures, NoiseKey, PicturedScene

OPTICS_PHRASES = {
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
    `alone` the pictures show the target without other bodies. `field` is the field of the optics
    that is changed.
    """

    phrase: str
    eye: MountedCamera
    values: dict[str, Raw]
    factor: float = 1.0
    offset: tuple[float, float] = (0.0, 0.0)
    alone: bool = False
    field: str = ""


class TargetAlone(NamedTuple):
    """The scene of a run, reduced to one object in its pictures."""

    objects: tuple[Object, ...]
    tree: Tree
    light: Light
    background: float
    robots: tuple[Robot, ...] = ()
    cameras: tuple[MountedCamera, ...] = ()


class DetectedMarks(NamedTuple):
    """Marks at some instants of a run, and the same marks as a detector found them.

    Attributes
    ----------
    deviation : ndarray of shape (T, N, 2)
        Pixels from the true mark to the detected mark, NaN for marks that were not found.
    visible : ndarray of bool, shape (T, N)
        Whether the true mark is in the image.
    """

    deviation: Array
    visible: NDArray[np.bool_]

    @property
    def missed(self) -> NDArray[np.bool_]:
        """Whether (T, N) a mark in the image was not found."""
        return np.isnan(self.deviation).any(axis=2) & self.visible


def list_changes(eye: MountedCamera) -> Iterator[PictureChange]:
    """Yield the cameras without one error of the optics, and with twice the pixels."""
    yield from list_optics_changes(eye)
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


def list_optics_changes(eye: MountedCamera) -> Iterator[PictureChange]:
    """Yield the cameras without one error of the optics."""
    optics = Optics() if eye.optics is None else eye.optics
    for each in fields_of(Optics):
        value, off = vars(optics)[each.name], each.default
        if value != off and each.name in OPTICS_PHRASES:
            without = replace(optics, **{each.name: off})
            path = f"cameras.{eye.name}.optics.{each.name}"
            phrase = f"without {OPTICS_PHRASES[each.name]} ({each.name} = {value:.4g})"
            yield PictureChange(phrase, replace(eye, optics=without), {path: off}, field=each.name)


def detect_again(
    again: Resimulation,
    sight: CameraTarget,
    change: PictureChange,
    detector: MarkDetector,
    instants: NDArray[np.int64],
) -> DetectedMarks:
    """Return the marks that a detector finds near their true pixels, in pictures with a change.

    The pictures have the noise and the motion of the run.
    """
    scene, loop, thing = sight.scene, again.loop, sight.target
    shown: PicturedScene = scene
    if change.alone:
        shown = TargetAlone((thing,), scene.tree, scene.light, scene.background)
    pictures = CameraPictures(shown, change.eye)
    believed = again.controller.believed_sights.get(sight.key, sight).eye.camera
    camera = believed if change.eye.camera is sight.eye.camera else change.eye.camera
    deviations, visible = [], []
    for t in instants:
        now, before = again.state(t), again.state(max(t - 1, 0))
        key = NoiseKey(loop.seed, loop.runs.astype(np.uint64), int(t))
        picture = pictures.take(now.q, (now.q - before.q) / loop.dt, key)
        view = now.projections[sight.key]
        true = change.factor * np.moveaxis(view.pixels, -1, 0) + change.offset
        search = MarkSearch(thing.mark_target, np.asarray(thing.marks), camera, np.rint(true))
        deviations.append((detector.find(picture, search)[0] - true[0]) / change.factor)
        visible.append(view.visibility[:, 0] == 0)
    return DetectedMarks(np.array(deviations), np.array(visible))
