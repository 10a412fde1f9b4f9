"""The image of an instant as rows of a program, on its way from the camera to the controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, last_view, shown_view
from robsim.kernels.control.commanding import copied
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.world.imperfections.exposure import Exposure, like

Seen = Callable[[Array, Exposure], Array]


class MarkGroup(NamedTuple):
    """The marks of one target in the image of one camera: the first of all marks, and how many."""

    camera: str
    target: str
    first: int
    size: int

    @property
    def rows(self) -> slice:
        """Where they stand among all marks."""
        return slice(self.first, self.first + self.size)


@dataclass
class ImageRows:
    """The rows of an image to which effects add their stages, one after the other.

    program   the stages of a period; an effect keeps what it remembers in new rows of it
    groups    the marks of each camera and target
    every     control periods between images: a stage does nothing in the others
    pixels    rows of the pixels (N, 2), which are the true ones until `own_pixels`
    dt        row of the control period, and `seconds` the same number
    latency   row of the age of the image in seconds, and `age` the same number
    seed      of random numbers, and `run` the row of the number of each run
    stream    the first of two streams of random numbers of an effect
    owned     whether the pixels may be changed in place
    hidden    rows of whether each mark is hidden (N,), None if none can be
    lost      row of whether the image is lost, None if none can be
    """

    program: Program
    groups: Sequence[MarkGroup]
    every: int
    pixels: Rows
    dt: Rows
    seconds: float
    latency: Rows
    age: float
    seed: np.uint64
    run: Rows
    stream: int = 0
    owned: bool = False
    hidden: Rows | None = None
    lost: Rows | None = None

    @property
    def N(self) -> int:
        """The number of marks in the image."""
        return sum(each.size for each in self.groups)

    @property
    def key(self) -> dict[str, Any]:
        """The seed, the row of the number of the run, and the stream, as stages take them."""
        return {"seed": self.seed.astype(np.int64), "run": self.run, "stream": self.stream}

    def new_pixels(self) -> Rows:
        """Return new rows (N, 2), which are the pixels from here on."""
        self.pixels, self.owned = self.program.rows(self.N, 2), True
        return self.pixels

    def own_pixels(self) -> Rows:
        """Return rows (N, 2) of pixels to change in place; a copy if they are the true ones."""
        if not self.owned:
            before = self.pixels
            self.program.add(copied, rows=before.flat, to=self.new_pixels().flat)
        return self.pixels

    def hidden_marks(self) -> Rows:
        """Return rows (N,) to set to one for marks that do not arrive with this image."""
        if self.hidden is None:
            self.hidden = self._cleared(self.N)
        return self.hidden

    def lost_images(self) -> Rows:
        """Return the row to set to one if this image does not arrive."""
        if self.lost is None:
            self.lost = self._cleared(1)[0]
        return self.lost

    def call(self, seen: Seen, name: str) -> None:
        """Add a function in Python from pixels (B, N, 2) of a target to others."""
        self.program.call(partial(self._called, seen, name, self.own_pixels(), self.stream))

    def _called(
        self, seen: Seen, name: str, own: Rows, stream: int, blocks: Blocks, step: int
    ) -> None:
        if step % self.every:
            return
        pixels = blocks.get(own)
        runs = blocks.get(self.run).view(np.uint64)
        time = max(step * self.seconds - self.age, 0.0)
        for camera, target, start, count in self.groups:
            shot = Exposure(time, camera, target, step, self.seed, runs, stream)
            before = shown_view(pixels[start : start + count])
            found = like(before, seen(before, shot), f"{name}.seen", gaps=True)
            pixels[start : start + count] = last_view(found)
        blocks.put(own, pixels)

    def _cleared(self, count: int) -> Rows:
        """Return new rows that are zero at the begin of every period."""
        found = self.program.rows(count)
        self.program.add(copied, rows=self.program.constant(np.zeros(count)), to=found)
        return found
