"""Marks that detectors find in rendered pictures, as a stage of the image stream."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.features.images.taken_pictures import find_pictures
from robsim.kernels.formulas.perspective import IN_IMAGE, UNDETECTED
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch, Picture
from robsim.world.imperfections.image_effect import ImageRows, MarkGroup, check_effect_result
from robsim.world.scene_picture import get_target_of_run


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
        Hidden marks (N,), and the number of periods between images.
    pixels : Rows
        Pixels (N, 2) of the marks, before the effects on measured pixels.
    last : Rows
        Pixels (N, 2) at which the marks were found last.
    status : Rows
        Status of the image, which becomes UNDETECTED if a start lacks marks.
    """

    image: ImageRows
    pixels: BlockRows
    last: BlockRows
    status: BlockRows


class MarkDetection:
    """The Python stage that detects the marks in the pictures of an instant.

    Marks that are not found are hidden; at the first instant they end the run unless their pair is
    optional.
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
        self.optional, self.rows = optional, rows
        each = zip(sights, groups, strict=True)
        pairs = [(s, g, s.key) for s, g in each if s.key in detectors]
        self.pairs = [
            DetectedPair(s.eye.name, s, believed.get(key, s), g, detectors[key])
            for s, g, key in pairs
        ]

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Replace the pixels of the marks of all runs by the detected ones."""
        rows, image = self.rows, self.rows.image
        if step % image.every:
            return
        pixels, last = blocks.get(rows.pixels), blocks.get(rows.last)
        hidden, status = blocks.get(image.hidden), blocks.get(rows.status)
        if step == 0:
            last = np.rint(pixels)
        for pair, some, found in self._find_marks(blocks, step, last):
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
        self, blocks: Blocks, step: int, last: Array
    ) -> Iterator[tuple[DetectedPair, NDArray[np.int64], Array]]:
        """Yield each pair with some runs and its pixels (N, 2, runs), NaN for marks not found."""
        number = step // self.rows.image.every
        for pair in self.pairs:
            taken = find_pictures(blocks, pair.camera)
            if taken is None or not len(taken.runs):
                continue
            places = np.moveaxis(last[pair.group.rows][..., taken.runs], -1, 0)
            found = find_marks(pair, taken.grey, places, number, blocks.rows[taken.runs])
            yield pair, taken.runs, np.moveaxis(found, 0, -1)


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
    sights: Sequence[CameraTarget], detectors: Mapping[PairKey, MarkDetector]
) -> None:
    """Raise InputError if a detector cannot detect its marks."""
    for sight in (each for each in sights if each.key in detectors):
        thing, camera = sight.target, sight.eye.camera
        detectors[sight.key].check(thing.mark_target, np.asarray(thing.marks), camera)
