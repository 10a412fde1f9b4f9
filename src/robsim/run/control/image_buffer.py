"""The images that a controller goes by: the last ones, each with the time it was taken at."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.machine.program import Blocks, Program
from robsim.run.control.mark_input import MarkObservation, MarkReader
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.controller_rows import add_image
from robsim.servo.frame_rows import add_body_poses
from robsim.world.scene import Scene

REMEMBERED = 512  # periods, whose joints are looked up for an image that was taken then
AHEAD = 0.1  # seconds by which the clock of a camera may be ahead
FAR = 1e9  # pixels from which on none is that of a mark, where a camera has no size


class LatestMarks:
    """The marks of one camera on one target, each where it was seen last.

    `excused` says that marks may be out of the image, `whole` that a feature needs all of them at
    once.
    """

    def __init__(self, sight: CameraTarget, excused: bool, whole: bool) -> None:
        N, size = len(sight.target.marks), sight.eye.camera.size
        self.sight, self.excused, self.whole = sight, excused, whole
        self.pixels, self.depth = np.full((N, 2), np.nan), np.ones(N)
        self.hidden = np.ones(N, dtype=bool)  # in the last image
        self.taken, self.seen = -math.inf, -math.inf  # the last image, and the last that serves
        self.most = np.full(2, FAR) if size is None else 2.0 * np.array(size, dtype=float)

    @property
    def known(self) -> bool:
        """Whether every mark has been seen once, or any, where marks may be out of the image."""
        never = np.isnan(self.pixels)
        return not (never.all() if self.excused else never.any())

    @property
    def complete(self) -> bool:
        """Whether the last image has all the marks that it needs to have."""
        return self.excused or not self.hidden.any()

    def take(self, found: MarkObservation, depth: Array) -> None:
        """Let an image be the last one; marks that it does not have stay where they were.

        What is a whole image away from the image is no mark.
        """
        near = np.abs(found.pixels - 0.25 * self.most) <= 0.75 * self.most
        there = near[:, 0] & near[:, 1]
        self.taken, self.hidden = found.t, ~there
        if there.all():
            self.pixels, self.depth, self.seen = found.pixels, depth, found.t
        elif there.any():
            self.pixels[there], self.depth[there] = found.pixels[there], depth[there]
            if not self.whole:
                self.seen = found.t


class ImageBuffer:
    """The last images of all sights, and the joints when they were taken."""

    def __init__(
        self,
        scene: Scene,
        sights: Sequence[CameraTarget],
        excused: Collection[PairKey],
        whole: Collection[PairKey],
    ) -> None:
        self.reader = MarkReader(sights)
        self.each = {s.key: LatestMarks(s, s.key in excused, s.key in whole) for s in sights}
        self._depths = _MarkDepths(scene, sights)
        self._times = np.full(REMEMBERED, -math.inf)
        self._q = np.empty((REMEMBERED, scene.nq))
        self._count = 0
        self._new: set[PairKey] = set()

    @property
    def known(self) -> bool:
        """Whether enough has been seen of every sight."""
        return all(image.known for image in self.each.values())

    @property
    def complete(self) -> bool:
        """Whether the last images have all the marks that they need to have."""
        return all(image.complete for image in self.each.values())

    def age(self, t: float) -> float:
        """Return how long ago the oldest of the last images was taken that can be gone by."""
        return max((t - image.seen for image in self.each.values() if image.seen < t), default=0.0)

    def forget_times(self) -> None:
        """Take all images for old, as the clock is another."""
        self._times[:] = -math.inf
        for image in self.each.values():
            image.taken = image.seen = -math.inf

    def lost(self) -> tuple[str, ...]:
        """Return the names of the marks that the last images do not have."""
        several = len(self.reader.cameras) > 1
        return tuple(
            f"{camera}: {target}[{i}]" if several else f"{target}[{i}]"
            for (camera, target), image in self.each.items()
            if image.hidden.any()
            for i in np.flatnonzero(image.hidden)
        )

    def seen(self) -> Array:
        """Return the pixels (N, 2) of all sights, NaN of marks that the last call did not show."""
        every = [np.empty((0, 2))]
        for key, image in self.each.items():
            gone = image.hidden | (key not in self._new)
            every.append(np.where(gone[:, None], np.nan, image.pixels))
        return np.concatenate(every)

    def note(self, q: Array, t: float) -> None:
        """Remember the joints at the begin of a period."""
        i = self._count % REMEMBERED
        self._times[i], self._q[i], self._count = t, q, self._count + 1

    def nothing_new(self) -> None:
        """Let no image be new in this call."""
        self._new = set()

    def take(self, given: Any, q: Array, t: float) -> tuple[str, ...]:
        """Take what is new, given the joints at a time; return the names of what is not used."""
        odd = []
        for each in list(self.reader.read(given, t)):
            image, name = self.each[each.sight.key], each.sight.eye.name
            if each.t > t + AHEAD:
                odd.append(f"image of {name} taken in the future")
            elif each.t > image.taken:
                image.take(each, self._depths(each, self._joints(each.t, q, t)))
                self._new.add(each.sight.key)
            elif each.t < image.taken:
                odd.append(f"late image of {name}")
        return (*self.reader.unused, *odd)

    def _joints(self, taken: float, q: Array, t: float) -> Array:
        """Return the coordinates that were measured nearest to a time."""
        if taken >= t:
            return q
        nearest: Array = self._q[int(np.argmin(np.abs(self._times - taken)))]
        return nearest


class _MarkDepths:
    """The depths of marks as the scene has them, at coordinates of the joints."""

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
        """Return the depths (N,) of the marks of a sight in metres."""
        self.blocks.fill(self.q, q)
        for part in self.parts:
            part(self.blocks, 0)
        return self.blocks.first(self.rows[of.sight.key])
