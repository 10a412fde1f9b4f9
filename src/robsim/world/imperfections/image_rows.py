"""The image of an instant as rows of a program, on its way from the camera to the controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array, last_view, shown_view
from robsim.kernels.control.commanding import copied
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.exposure import Exposure, like

Seen = Callable[[Array, Exposure], Array]


class MarkGroup(NamedTuple):
    """The marks of one target in the image of one camera: the first of all marks, and how many."""

    camera: str
    target: str
    first: int
    size: int


@dataclass
class ImageRows:
    """The rows of an image to which effects add their stages, one after the other.

    program   the stages of a period; an effect keeps what it remembers in new rows of it
    groups    the marks of each camera and target
    every     control periods between images: a stage does nothing in the others
    pixels    first row of the pixels (N, 2), which are the true ones until `own_pixels`
    dt        row of the control period, and `seconds` the same number
    latency   row of the age of the image in seconds, and `age` the same number
    seed      of random numbers, and `run` the row of the number of each run
    stream    the first of two streams of random numbers of an effect
    owned     whether the pixels may be changed in place
    hidden    first row of whether each mark is hidden (N,), -1 if none can be
    lost      row of whether the image is lost, -1 if none can be
    """

    program: Program
    groups: Sequence[MarkGroup]
    every: int
    pixels: int
    dt: int
    seconds: float
    latency: int
    age: float
    seed: np.uint64
    run: int
    stream: int = 0
    owned: bool = False
    hidden: int = -1
    lost: int = -1

    @property
    def N(self) -> int:
        """The number of marks in the image."""
        return sum(each.size for each in self.groups)

    @property
    def key(self) -> tuple[int, int, int]:
        """The seed, the row of the number of the run, and the stream, as stages take them."""
        return int(self.seed.astype(np.int64)), self.run, self.stream

    def new_pixels(self) -> int:
        """Return new rows (N, 2), which are the pixels from here on."""
        self.pixels, self.owned = self.program.rows(2 * self.N), True
        return self.pixels

    def own_pixels(self) -> int:
        """Return rows (N, 2) of pixels to change in place; a copy if they are the true ones."""
        if not self.owned:
            before = self.pixels
            self.program.add(copied, 2 * self.N, before, self.new_pixels())
        return self.pixels

    def hidden_marks(self) -> int:
        """Return rows (N,) to set to one for marks that do not arrive with this image."""
        if self.hidden < 0:
            self.hidden = self._cleared(self.N)
        return self.hidden

    def lost_images(self) -> int:
        """Return the row to set to one if this image does not arrive."""
        if self.lost < 0:
            self.lost = self._cleared(1)
        return self.lost

    def call(self, seen: Seen, name: str) -> None:
        """Add a function in Python from pixels (B, N, 2) of a target to others."""
        self.program.call(partial(self._called, seen, name, self.own_pixels(), self.stream))

    def _called(
        self, seen: Seen, name: str, first: int, stream: int, blocks: Blocks, step: int
    ) -> None:
        if step % self.every:
            return
        pixels = blocks.get(first, self.N, 2)
        runs = blocks.get(self.run, 1)[0].view(np.uint64)
        time = max(step * self.seconds - self.age, 0.0)
        for camera, target, start, count in self.groups:
            shot = Exposure(time, camera, target, step, self.seed, runs, stream)
            before = shown_view(pixels[start : start + count])
            found = like(before, seen(before, shot), f"{name}.seen", gaps=True)
            pixels[start : start + count] = last_view(found)
        blocks.put(first, pixels)

    def _cleared(self, count: int) -> int:
        """Return new rows that are zero at the begin of every period."""
        found = self.program.rows(count)
        self.program.add(copied, count, self.program.constant(np.zeros(count)), found)
        return found
