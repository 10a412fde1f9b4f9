"""The last images of a controller, each with its capture time."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.machine.program import Blocks, Program
from robsim.run.control.mark_input import MarkObservation, MarkReader
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.controller_rows import add_image
from robsim.servo.frame_rows import add_body_poses
from robsim.world.scene import Scene

REMEMBERED = 512  # periods with stored joints, for images that arrive late
AHEAD = 0.1  # largest lead of the clock of a camera, in seconds
SAME_TIME = 1e-9  # seconds: difference of times that counts as rounding
FAR = 1e9  # pixels; larger coordinates are invalid if the image size is unknown


class LatestMarks:
    """The last seen pixels and depths of the marks of one camera and target.

    `may_leave_image` allows marks outside the image. `whole` means that a feature needs all marks
    in one image. A pair may be observed by pictures instead, without pixels of its marks.
    """

    def __init__(self, sight: CameraTarget, may_leave_image: bool, whole: bool) -> None:
        N, size = len(sight.target.marks), sight.eye.camera.size
        self.sight, self.may_leave_image, self.whole = sight, may_leave_image, whole
        self.pixels, self.depth = np.full((N, 2), np.nan), np.ones(N)
        self.hidden = np.ones(N, dtype=bool)  # in the last image
        self.in_pictures = False  # whether pictures replace the marks
        self.image_time, self.usable_time = (
            -math.inf,
            -math.inf,
        )  # times of the last and last usable image
        self.most = np.full(2, FAR) if size is None else 2.0 * np.array(size, dtype=float)

    @property
    def is_known(self) -> bool:
        """Whether enough marks have been seen: every mark, or any mark if `may_leave_image`."""
        if self.in_pictures:
            return self.usable_time > -math.inf
        never = np.isnan(self.pixels)
        return not (never.all() if self.may_leave_image else never.any())

    @property
    def complete(self) -> bool:
        """Whether the last image has all the marks that it must have."""
        return self.may_leave_image or not self.hidden.any()

    def take_picture(self, depth: Array, t: float) -> None:
        """Store the time of a picture that replaces the marks, and their depths."""
        self.in_pictures = True
        self.depth, self.image_time, self.usable_time = depth, t, t
        self.hidden = np.zeros_like(self.hidden)

    def take(self, observed: MarkObservation, depth: Array) -> None:
        """Store an image; marks that are missing in it keep their last pixels.

        Coordinates farther than one image size from the image are treated as missing.
        """
        near = np.abs(observed.pixels - 0.25 * self.most) <= 0.75 * self.most
        valid = near[:, 0] & near[:, 1]
        self.image_time, self.hidden = observed.t, ~valid
        if valid.all():
            self.pixels, self.depth, self.usable_time = observed.pixels, depth, observed.t
        elif valid.any():
            self.pixels[valid], self.depth[valid] = observed.pixels[valid], depth[valid]
            if not self.whole:
                self.usable_time = observed.t


class ImageBuffer:
    """The last images of all camera-target pairs, and the joints of recent periods."""

    def __init__(
        self,
        scene: Scene,
        sights: Sequence[CameraTarget],
        optional_pairs: Collection[PairKey],
        whole: Collection[PairKey],
    ) -> None:
        self.reader = MarkReader(sights)
        self.each = {s.key: LatestMarks(s, s.key in optional_pairs, s.key in whole) for s in sights}
        self._depths, self._tree = _MarkDepths(scene, sights), scene.tree
        self._times = np.full(REMEMBERED, -math.inf)
        self._q = np.empty((REMEMBERED, scene.nq))
        self._count = 0
        self._new: set[PairKey] = set()

    @property
    def are_known(self) -> bool:
        """Whether enough marks of every camera-target pair have been seen."""
        return all(image.is_known for image in self.each.values())

    @property
    def complete(self) -> bool:
        """Whether the last images have all the marks that they must have."""
        return all(image.complete for image in self.each.values())

    def age(self, t: float) -> float:
        """Return the age in seconds of the oldest of the last usable images."""
        return max(
            (t - image.usable_time for image in self.each.values() if image.usable_time < t),
            default=0.0,
        )

    def forget_times(self) -> None:
        """Treat all images as old, because the clock was restarted."""
        self._times[:] = -math.inf
        for image in self.each.values():
            image.image_time = image.usable_time = -math.inf

    def list_lost_marks(self) -> tuple[str, ...]:
        """Return the names of the marks that are missing in the last images."""
        several = len(self.reader.cameras) > 1
        return tuple(
            f"{camera}: {target}[{i}]" if several else f"{target}[{i}]"
            for (camera, target), image in self.each.items()
            if image.hidden.any()
            for i in np.flatnonzero(image.hidden)
        )

    def collect_new_pixels(self) -> Array:
        """Return the pixels (N, 2) of all camera-target pairs; NaN for marks without new pixels."""
        every = [np.empty((0, 2))]
        for key, image in self.each.items():
            missing = image.hidden | image.in_pictures | (key not in self._new)
            every.append(np.where(missing[:, None], np.nan, image.pixels))
        return np.concatenate(every)

    def list_new_image_times(self) -> dict[PairKey, float]:
        """Return the capture time of the last image of each camera-target pair; NaN if not new."""
        return {
            key: image.image_time if key in self._new else math.nan
            for key, image in self.each.items()
        }

    def store_joints(self, q: Array, t: float) -> None:
        """Store the joints at the start of a period."""
        i = self._count % REMEMBERED
        self._times[i], self._q[i], self._count = t, q, self._count + 1

    def clear_new(self) -> None:
        """Mark all images as not new in this call."""
        self._new = set()

    def take(self, pixels: Any, q: Array, t: float) -> tuple[str, ...]:
        """Store new images with the joints at a time, and return the names of unused data."""
        rejected = self.store(list(self.reader.read(pixels, t)), q, t)
        return (*self.reader.unused, *rejected)

    def store(self, observed: Iterable[MarkObservation], q: Array, t: float) -> list[str]:
        """Store the new ones of some images, and return the names of those that are rejected."""
        rejected = []
        for each in observed:
            image, name = self.each[each.sight.key], each.sight.eye.name
            if each.t > t + AHEAD:
                rejected.append(f"image of {name} taken in the future")
            elif each.t > image.image_time:
                image.take(each, self._depths(each, self._joints(each.t, q, t)))
                self._new.add(each.sight.key)
            elif each.t < image.image_time:
                rejected.append(f"late image of {name}")
        return rejected

    def take_picture(self, sight: CameraTarget, q: Array, t: float) -> None:
        """Store the time and the joints of a picture that replaces the marks of a pair."""
        image = self.each[sight.key]
        unseen = MarkObservation(sight, np.full((len(sight.target.marks), 2), np.nan), t)
        image.take_picture(self._depths(unseen, q), t)
        self._new.add(sight.key)

    def _joints(self, taken: float, q: Array, t: float) -> Array:
        """Return the measured coordinates at a time, between the coordinates before and after."""
        if taken >= t:
            return q
        away = self._times - taken
        nearest = int(np.argmin(np.abs(away)))
        before = np.where(away <= 0.0, away, -np.inf)
        start = int(np.argmax(before))
        if abs(away[nearest]) < SAME_TIME or before[start] == -np.inf:
            stored: Array = self._q[nearest]
            return stored.copy()
        later = np.where(away > 0.0, away, np.inf)
        i = int(np.argmin(later))
        end, seconds = (self._q[i], later[i]) if later[i] < t - taken else (q, t - taken)
        share = np.array([before[start] / (before[start] - seconds)])
        between: Array = self._tree.between(self._q[start][:, None], end[:, None], share)
        return between[:, 0]


class _MarkDepths:
    """The depths of marks in the scene, as a function of the joint coordinates."""

    def __init__(self, scene: Scene, sights: Sequence[CameraTarget]) -> None:
        program = Program()
        self.q = program.rows(scene.nq)
        placed, status, self.rows = add_body_poses(program, scene.tree, self.q), program.rows(), {}
        for sight in sights:
            N = len(sight.target.marks)
            image = program.rows(N, 2), program.rows(N), status
            self.rows[sight.key] = add_image(program, placed, sight, *image).depth
        self.blocks = Blocks(program, np.zeros(1, dtype=np.int64))
        self.parts = program.segments()

    def __call__(self, of: MarkObservation, q: Array) -> Array:
        """Return the depths (N,) in metres of the marks of an observation."""
        self.blocks.fill(self.q, q)
        for part in self.parts:
            part(self.blocks, 0)
        return self.blocks.first(self.rows[of.sight.key])
