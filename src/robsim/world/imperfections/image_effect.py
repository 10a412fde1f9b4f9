"""Imperfections of the images: what each kind declares, and the rows to which it adds stages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats, view_for_user, view_runs_first, view_runs_last
from robsim.base.errors import InputError
from robsim.declare import KindOf, ListOf, family
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.formulas import random
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.imperfection import Imperfection

IMAGE_EFFECTS = family("image effect")
FIRST_STREAM = 16  # of random numbers of effects; those below are of the short form


@dataclass(frozen=True, eq=False)
class EffectContext:
    """Random numbers, keyed by the seed and the number of each run, and counted by the step.

    So a run has the same ones alone and in any batch. `time` is in seconds since the start.
    """

    time: float
    step: int
    seed: np.uint64
    runs: NDArray[np.uint64]  # (B,)
    stream: int

    def normal_pairs(self, count: int) -> Array:
        """Return independent standard normal numbers (count, 2, B)."""
        out = np.empty((count, 2, self.runs.size))
        random.fill_normal_pairs(self.seed, self.runs, self.step, self.stream, out)
        return out


@dataclass(frozen=True, eq=False)
class Exposure(EffectContext):
    """When an image was taken, by which camera of which target, for B runs."""

    camera: str
    target: str

    def normal(self, marks: int) -> Array:
        """Return independent standard normal numbers (B, marks, 2)."""
        return view_runs_first(self.normal_pairs(marks))

    def uniform(self, marks: int) -> Array:
        """Return independent uniform numbers (B, marks), between 0 and 1."""
        out = np.empty((marks, self.runs.size))
        random.fill_uniform_numbers(self.seed, self.runs, self.step, self.stream + 1, out)
        return view_runs_first(out)


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

    program  the stages of a period; an effect keeps what it remembers in new rows of it
    groups   the marks of each camera and target
    every    control periods between images: a stage does nothing in the others
    pixels   rows of the pixels (N, 2), which are the true ones until `own_pixels`
    hidden   rows of whether each mark is hidden (N,), to be set to one
    lost     row of whether the image is lost, to be set to one
    dt       row of the control period
    latency  row of the age of the image in seconds
    seed     of random numbers, and `run` the row of the number of each run
    stream   the first of two streams of random numbers of an effect
    owned    whether the pixels may be changed in place
    """

    program: Program
    groups: Sequence[MarkGroup]
    every: int
    pixels: BlockRows
    hidden: BlockRows
    lost: BlockRows
    dt: BlockRows
    latency: BlockRows
    seed: np.uint64
    run: BlockRows
    stream: int = 0
    owned: bool = False

    @property
    def N(self) -> int:
        """The number of marks in the image."""
        return sum(each.size for each in self.groups)

    @property
    def key(self) -> dict[str, Any]:
        """The seed, the row of the number of the run, and the stream, as stages take them."""
        return {"seed": self.seed.astype(np.int64), "run": self.run, "stream": self.stream}

    def new_pixels(self) -> BlockRows:
        """Return new rows (N, 2), which are the pixels from here on."""
        self.pixels, self.owned = self.program.rows(self.N, 2), True
        return self.pixels

    def own_pixels(self) -> BlockRows:
        """Return rows (N, 2) of pixels to change in place; a copy if they are the true ones."""
        if not self.owned:
            before = self.pixels
            self.program.add(copy_rows, rows=before.flat, to=self.new_pixels().flat)
        return self.pixels

    def call(self, seen: Callable[[Array, Exposure], Array], name: str) -> None:
        """Add a function in Python from pixels (B, N, 2) of a target to others."""
        self.program.call(partial(self._called, seen, name, self.own_pixels(), self.stream))

    def _called(
        self, seen: Any, name: str, own: BlockRows, stream: int, blocks: Blocks, step: int
    ) -> None:
        if step % self.every:
            return
        pixels, runs = blocks.get(own), blocks.get(self.run).view(np.uint64)
        times = np.maximum(step * blocks.get(self.dt) - blocks.get(self.latency), 0.0)
        for time in np.unique(times):  # of runs whose images are of the same age
            some = times == time
            when = float(time), step, self.seed, runs[some], stream
            for group in self.groups:
                marks = pixels[group.rows]
                before = view_for_user(marks[..., some])
                found = seen(before, Exposure(*when, group.camera, group.target))
                marks[..., some] = view_runs_last(
                    check_effect_result(before, found, f"{name}.seen", gaps=True)
                )
        blocks.put(own, pixels)


class ImageEffectStage(IntEnum):
    """The place of an effect on the way of an image from the camera to the controller."""

    TAKEN = 0  # when images are taken and used: a `timing`, but no stages
    MEASURED = 1  # where marks are seen
    ROUNDED = 2  # to the resolution of the image
    HIDDEN = 3  # which marks arrive
    LOST = 4  # which images arrive


class ImageTiming(NamedTuple):
    """When images are taken and used.

    every    control periods from one image to the next
    latency  seconds from when an image is taken until it is used
    lost     share of the images that never arrive
    """

    every: int = 1
    latency: float = 0.0
    lost: float = 0.0

    def and_also(self, other: ImageTiming) -> ImageTiming:
        """Return the times under two effects: latencies add up, the rarer images count."""
        lost = self.lost + other.lost - self.lost * other.lost
        return ImageTiming(max(self.every, other.every), self.latency + other.latency, lost)


class ImageEffect(Imperfection):
    """A kind of imperfection of the images, with all that is known of it.

    A kind is a frozen dataclass of declared fields, registered as an "image effect". It adds
    compiled stages (`add_stages`), or it is called in Python at every image (`seen`). The other
    methods are for those who explain runs and give advice.

    place  where it acts between the camera and the controller
    """

    called: ClassVar[str] = "seen"
    place: ClassVar[ImageEffectStage] = ImageEffectStage.MEASURED
    title: ClassVar[str] = "effects on the images"
    changed: ClassVar[str] = "The images are"

    def check(self, groups: Sequence[MarkGroup]) -> None:
        """Raise InputError if the effect does not fit the cameras and marks of a task."""

    def timing(self, dt: float) -> ImageTiming:
        """Return its part in when images are taken and used, at a control period."""
        return ImageTiming()

    def deviation(self, robust: bool) -> float:
        """Return the standard deviation of a pixel coordinate, maybe under robust weights."""
        return 0.0

    def in_views(self, pixels: Array, normal: Callable[[], Array]) -> Array:
        """Return the pixels (V, N, 2) of views by a robot that stands still.

        `normal()` are standard normal numbers of the same shape.
        """
        if self.place is ImageEffectStage.TAKEN:
            return pixels
        raise InputError("views have noise and quantisation only; leave it out")


@runtime_checkable
class OwnImageEffect(Protocol):
    """What anything must have to be an effect on images: a user's class needs no base class.

    Registered with `register("image effect", "my_effect")`, it has a place in scenario files.
    """

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        """Return where the marks are seen (B, N, 2), from where they would be, in pixels."""


ImageEffectList = Annotated[
    tuple[ImageEffect | OwnImageEffect, ...],
    ListOf(KindOf(IMAGE_EFFECTS, protocol=OwnImageEffect), most=64, alone=True),
    "Effects of other kinds, or of a kind of your own, one after the other.",
]


def check_effect_result(before: Array, given: Any, who: str, *, gaps: bool = False) -> Array:
    """Return what a user's effect made of an array; InputError unless it is of the same shape."""
    found = as_floats(given, who, before.shape[1:], gaps=gaps)
    if found.shape != before.shape:
        raise InputError(f"{who}: expected shape {before.shape}, got {found.shape}")
    return found
