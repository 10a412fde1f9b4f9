"""Marks that detectors find in rendered pictures, as a stage of the image stream."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import groupby
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.formulas.perspective import IN_IMAGE, UNDETECTED
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch, Picture
from robsim.world.imperfections.image_effect import ImageRows, MarkGroup, check_effect_result
from robsim.world.mounted_camera import get_picture_size
from robsim.world.scene_picture import (
    CameraPictures,
    NoiseKey,
    get_target_of_run,
    warn_missing_meshes,
)

MOST_BYTES = 64_000_000  # of the pictures that are in memory at once


class DetectedPair(NamedTuple):
    """A camera and its target, as they are and as believed, their marks and their detector."""

    camera: str
    sight: CameraTarget
    believed: CameraTarget
    group: MarkGroup
    detector: MarkDetector


@dataclass(frozen=True, eq=False)
class DetectionRows:
    """The rows that detection reads and writes.

    Attributes
    ----------
    image : ImageRows
        Hidden marks (N,), whether the image is lost, and the keys of the noise.
    pixels : Rows
        Pixels (N, 2) of the marks, before the effects on measured pixels.
    exposed : Rows
        Coordinates of the scene at the time of the image (nq,) and earlier (nq,), and the seconds
        between them.
    last : Rows
        Pixels (N, 2) at which the marks were found last.
    status : Rows
        Status of the image, which becomes UNDETECTED if a start lacks marks.
    hashes : Rows
        Hash of the newest picture of each camera, in the order of their names.
    """

    image: ImageRows
    pixels: BlockRows
    exposed: BlockRows
    last: BlockRows
    status: BlockRows
    hashes: BlockRows


class MarkDetection:
    """The Python stage that draws the pictures of an instant and detects the marks in them.

    Each camera draws one picture for all of its targets. Lost images are not drawn. Marks that are
    not found are hidden; at the first instant they end the run unless their pair is optional.
    """

    def __init__(
        self,
        sights: Sequence[CameraTarget],
        groups: Sequence[MarkGroup],
        detectors: Mapping[PairKey, MarkDetector],
        believed: Mapping[PairKey, CameraTarget],
        optional: frozenset[PairKey],
        rows: DetectionRows,
    ) -> None:
        self.optional, self.rows, self.seed = optional, rows, int(rows.image.seed)
        self._of_thread = threading.local()
        each = zip(sights, groups, strict=True)
        pairs = [(s, g, s.key) for s, g in each if s.key in detectors]
        named = [
            DetectedPair(s.eye.name, s, believed.get(key, s), g, detectors[key])
            for s, g, key in pairs
        ]
        self.pairs = sorted(named, key=attrgetter("camera"))

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Replace the pixels of the marks of all runs by the detected ones."""
        rows, image = self.rows, self.rows.image
        if step % image.every:
            return
        pixels, last = blocks.get(rows.pixels), blocks.get(rows.last)
        hidden, status = blocks.get(image.hidden), blocks.get(rows.status)
        if step == 0:
            last = np.rint(pixels)
        arrived = (blocks.get(image.lost) == 0.0) | (step == 0)
        for pair, some, found in self._find_marks(blocks, step, arrived, last):
            marks, missing = pair.group.rows, np.isnan(found)
            pixels[marks, :, some] = found
            last[marks, :, some] = np.where(missing, last[marks][..., some], found)
            lacking = missing.any(axis=1)
            hidden[marks, some] = np.maximum(hidden[marks, some], lacking)
            if step == 0 and pair.sight.key not in self.optional:
                ends = lacking.any(axis=0) & (status[some] == IN_IMAGE)
                status[some] = np.where(ends, UNDETECTED, status[some])
        for row, values in (
            (rows.pixels, pixels),
            (rows.last, last),
            (image.hidden, hidden),
            (rows.status, status),
        ):
            blocks.put(row, values)

    def _find_marks(
        self, blocks: Blocks, step: int, arrived: NDArray[np.bool_], last: Array
    ) -> Iterator[tuple[DetectedPair, NDArray[np.int64], Array]]:
        """Yield each pair with some runs and its pixels (N, 2, runs), NaN for marks not found."""
        q, rates = self._find_motion(blocks)
        numbers = blocks.get(self.rows.image.run).view(np.uint64)
        drawn = np.flatnonzero(arrived & np.isfinite(q).all(axis=0))
        sources = self._pictures
        hashes = blocks.get(self.rows.hashes)
        each = groupby(self.pairs, key=attrgetter("camera"))
        for number, (camera, pairs) in enumerate(each):
            of_camera, source = list(pairs), sources[camera]
            width, height = source.size
            count = max(MOST_BYTES // (width * height), 1)
            for first in range(0, len(drawn), count):
                some = drawn[first : first + count]
                key = NoiseKey(self.seed, numbers[some], step)
                grey = source.take(q[:, some], rates[:, some], key, blocks.rows[some])
                hashes[number, some] = [compute_picture_hash(picture) for picture in grey]
                for pair in of_camera:
                    places = np.moveaxis(last[pair.group.rows][..., some], -1, 0)
                    number_in_run = step // self.rows.image.every
                    found = find_marks(pair, grey, places, number_in_run, blocks.rows[some])
                    yield pair, some, np.moveaxis(found, 0, -1)
        blocks.put(self.rows.hashes, hashes)

    def _find_motion(self, blocks: Blocks) -> tuple[Array, Array]:
        """Return the coordinates (nq, B) at the exposure, and their velocities (nq, B)."""
        exposed = blocks.get(self.rows.exposed)
        q, before = np.split(exposed[:-1], 2)
        with np.errstate(all="ignore"):  # a run may contain NaN, and the first image no motion
            return q, np.where(q == before, 0.0, (q - before) / exposed[-1])

    @property
    def _pictures(self) -> dict[str, CameraPictures]:
        """The pictures of each camera; each thread has its own."""
        if not hasattr(self._of_thread, "pictures"):
            sights = {pair.camera: pair.sight for pair in self.pairs}
            self._of_thread.pictures = {
                name: CameraPictures(each.scene, each.eye) for name, each in sights.items()
            }
        pictures: dict[str, CameraPictures] = self._of_thread.pictures
        return pictures


def find_marks(
    pair: DetectedPair, grey: Picture, last: Array, number: int, runs: NDArray[np.int64]
) -> Array:
    """Return the pixels (B, N, 2) of marks in pictures (B, h, w), NaN for marks not found.

    If the camera or the target differ from run to run, each picture is searched on its own.
    """
    thing, camera = pair.believed.target, pair.believed.eye.camera
    if camera.rows.shape[1] == 1 and np.ndim(thing.marks) == 2:
        found = pair.detector.find(grey, make_search(pair, last, number))
    else:
        each = [slice(b, b + 1) for b in range(len(runs))]
        found = np.concatenate(
            [
                pair.detector.find(grey[b], make_search(pair, last[b], number, int(run)))
                for b, run in zip(each, runs, strict=True)
            ]
        )
    return check_effect_result(last, found, f"{type(pair.detector).__name__}.find", gaps=True)


def make_search(pair: DetectedPair, last: Array, number: int, run: int = 0) -> MarkSearch:
    """Return the search for the marks of a pair, last seen at pixels (B, N, 2), in one run.

    A detector is software of the robot: it gets the believed camera and marks. A belief with marks
    only keeps the true target or picture, of which a detector knows the code and the pattern.
    """
    thing, camera = pair.believed.target, pair.believed.eye.camera.of_run(run)
    target = get_target_of_run(thing if thing.mark_target else pair.sight.target, run)
    marks = np.asarray(thing.marks)
    return MarkSearch(target, marks[..., run] if marks.ndim == 3 else marks, camera, last, number)


def check_detection(
    sights: Sequence[CameraTarget], detectors: Mapping[PairKey, MarkDetector], dt: float
) -> None:
    """Raise InputError if a detector cannot detect its marks, or an exposure is too long."""
    for sight in (each for each in sights if each.key in detectors):
        thing, eye = sight.target, sight.eye
        get_picture_size(eye)
        detectors[sight.key].check(thing.mark_target, np.asarray(thing.marks), eye.camera)
        warn_missing_meshes(sight.scene)
        seconds = 0.0 if eye.optics is None else float(np.max(eye.optics.duration))
        if seconds > dt:
            raise InputError(
                f"the exposure and readout of camera '{eye.name}' take {seconds:g} s; at most the "
                f"control period, {dt:g} s"
            )


def compute_picture_hash(picture: NDArray[np.uint8]) -> float:
    """Return 52 bits of the BLAKE2b hash of a picture, which a float stores exactly.

    >>> compute_picture_hash(np.zeros((2, 3), dtype=np.uint8))
    679958814734852.0
    """
    words = blake2b(picture.tobytes(), digest_size=8).digest()
    return float(int.from_bytes(words, "little") >> 12)
