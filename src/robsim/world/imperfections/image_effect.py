"""The base class of imperfections of images, and the program rows that they process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats, view_for_user, view_runs_first, view_runs_last
from robsim.base.errors import InputError
from robsim.base.named_integers import NamedInteger
from robsim.declare import KindOf, ListOf, family
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.formulas import random
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.imperfections.imperfection import Imperfection

IMAGE_EFFECTS = family("image effect")
FIRST_STREAM = 16  # first stream of random numbers of listed effects; single fields use 0 to 15


@dataclass(frozen=True, eq=False)
class EffectContext:
    """The time and the random numbers of an effect, for B runs.

    Random numbers are keyed by the seed and the number of each run, and counted by the step. A run
    therefore has the same numbers alone and in any batch. `time` is in seconds since the start.
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
    """The time, camera and target of an image, for B runs."""

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
    """The marks of one target in the image of one camera: the first index, and the number."""

    camera: str
    target: str
    first: int
    size: int

    @property
    def rows(self) -> slice:
        """The slice of these marks among all marks."""
        return slice(self.first, self.first + self.size)


@dataclass
class ImageRows:
    """The program rows of an image, for effects that add stages one after another.

    Attributes
    ----------
    program : Program
        Stages of a control period. An effect stores its state in new rows of the program.
    groups : sequence of MarkGroup
        Marks of each camera and target.
    every : int
        Control periods between images. A stage does nothing in the other periods.
    pixels : Rows
        Pixels (N, 2), the true pixels until `own_pixels` is called.
    hidden : Rows
        Whether each mark (N,) is hidden. A stage sets it to 1.
    lost : Rows
        Whether the image is lost. A stage sets it to 1.
    dt : Rows
        Control period in seconds.
    latency : Rows
        Age of the image in seconds.
    seed, run : uint64 and Rows
        Seed of the random numbers, and number of each run.
    stream : int
        First of two streams of random numbers of the effect.
    owns_pixels : bool
        Whether the pixels may be changed in place.
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
    owns_pixels: bool = False

    @property
    def N(self) -> int:
        """The number of marks in the image."""
        return sum(each.size for each in self.groups)

    @property
    def key(self) -> dict[str, Any]:  # Any: arguments of stages
        """The seed, the row of the run's number, and the stream, as keyword arguments of stages."""
        return {"seed": self.seed.astype(np.int64), "run": self.run, "stream": self.stream}

    def new_pixels(self) -> BlockRows:
        """Return new rows (N, 2), which contain the pixels from this effect on."""
        self.pixels, self.owns_pixels = self.program.rows(self.N, 2), True
        return self.pixels

    def own_pixels(self) -> BlockRows:
        """Return rows (N, 2) of pixels to change in place; the true pixels are copied first."""
        if not self.owns_pixels:
            before = self.pixels
            self.program.add(copy_rows, rows=before.flat, to=self.new_pixels().flat)
        return self.pixels

    def call(self, seen: Callable[[Array, Exposure], Array], name: str) -> None:
        """Add a Python function that maps the pixels (B, N, 2) of a target to other pixels."""
        self.program.call(partial(self._call_python, seen, name, self.own_pixels(), self.stream))

    def _call_python(
        self,
        seen: Callable[[Array, Exposure], Array],
        name: str,
        rows: BlockRows,
        stream: int,
        blocks: Blocks,
        step: int,
    ) -> None:
        """Call a Python effect for each target, for all runs with images of the same age."""
        if step % self.every:
            return
        pixels, runs = blocks.get(rows), blocks.get(self.run).view(np.uint64)
        times = np.maximum(step * blocks.get(self.dt) - blocks.get(self.latency), 0.0)
        for time in np.unique(times):  # runs with images of the same age
            same_age = times == time
            when = float(time), step, self.seed, runs[same_age], stream
            for group in self.groups:
                marks = pixels[group.rows]
                before = view_for_user(marks[..., same_age])
                result = seen(before, Exposure(*when, group.camera, group.target))
                marks[..., same_age] = view_runs_last(
                    check_effect_result(before, result, f"{name}.seen", gaps=True)
                )
        blocks.put(rows, pixels)


class ImageEffectStage(NamedInteger):
    """The stage of image formation that an effect belongs to, from the camera to the controller."""

    TAKEN = 0  # the effect has a `timing`, but no stages
    MEASURED = 1  # measured pixels of marks
    ROUNDED = 2  # pixels rounded to the resolution of the image
    HIDDEN = 3  # marks that are not seen
    LOST = 4  # images that do not arrive


class ImageTiming(NamedTuple):
    """The period, delay and loss of images.

    Attributes
    ----------
    every : int
        Control periods from one image to the next.
    latency : float
        Seconds from the exposure of an image until its use.
    lost : float
        Share of the images that never arrive.
    """

    every: int = 1
    latency: float = 0.0
    lost: float = 0.0

    def and_also(self, other: ImageTiming) -> ImageTiming:
        """Return the timing under two effects: delays add up, and the longer period counts."""
        lost = self.lost + other.lost - self.lost * other.lost
        return ImageTiming(max(self.every, other.every), self.latency + other.latency, lost)


class ImageEffect(Imperfection):
    """Base class of the imperfections of images.

    A kind is a frozen dataclass of declared fields, registered as an "image effect". It adds
    compiled stages (`add_stages`), or its Python method `seen` is called for every image. The other
    methods serve explanations of runs and advice.

    Attributes
    ----------
    place : ImageEffectStage
        Stage of image formation to which the effect belongs.

    Examples
    --------
    >>> from robsim import Sensing
    >>> @dataclass(frozen=True)
    ... class Shifted(ImageEffect):
    ...     def seen(self, pixels, exposure):
    ...         return pixels + [1.0, 0.0]
    >>> [each.effect.label for each in Sensing(effects=[Shifted()]).list_active()]
    ['Shifted']
    """

    method_name: ClassVar[str] = "seen"
    place: ClassVar[ImageEffectStage] = ImageEffectStage.MEASURED
    title: ClassVar[str] = "effects on the images"
    statement_subject: ClassVar[str] = "The images are"

    def check(self, groups: Sequence[MarkGroup]) -> None:
        """Raise InputError if the effect does not fit the cameras and marks of a task."""

    def timing(self, dt: float) -> ImageTiming:
        """Return the contribution to the timing of images at a control period."""
        return ImageTiming()

    def deviation(self, robust: bool) -> float:
        """Return the standard deviation of a pixel coordinate, with or without robust weights."""
        return 0.0

    def in_views(self, pixels: Array, normal: Callable[[], Array]) -> Array:
        """Return the pixels (V, N, 2) of views by a robot at rest, with this effect.

        `normal()` returns standard normal numbers of the same shape.
        """
        if self.place is ImageEffectStage.TAKEN:
            return pixels
        raise InputError("views have noise and quantisation only; leave it out")


@runtime_checkable
class OwnImageEffect(Protocol):
    """The protocol of a user-defined effect on images, which needs no base class.

    Register the class with `register("image effect", "my_effect")` to use it in scenario files.
    """

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        """Return the measured pixels (B, N, 2) of marks, given their pixels without this effect."""


ImageEffectList = Annotated[
    tuple[ImageEffect | OwnImageEffect, ...],
    ListOf(KindOf(IMAGE_EFFECTS, protocol=OwnImageEffect), most=64, alone=True),
    "Effects of further kinds or of user-defined kinds, applied one after the other.",
]


def check_effect_result(before: Array, value: Any, who: str, *, gaps: bool = False) -> Array:
    """Return the result of a user-defined effect; raise InputError if it changes the shape."""
    array = as_floats(value, who, before.shape[1:], gaps=gaps)
    if array.shape != before.shape:
        raise InputError(f"{who}: expected shape {before.shape}, got {array.shape}")
    return array
