"""The errors of the images that a controller gets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Annotated, ClassVar

from robsim.declare import Declared, ListOf, described
from robsim.world.imperfections.acting import Acting, acting
from robsim.world.imperfections.dropped import Dropped, DroppedImages
from robsim.world.imperfections.image_effect import (
    EFFECT,
    FIRST_STREAM,
    ImageEffect,
    ImageTiming,
    OwnImageEffect,
    image_effect,
)
from robsim.world.imperfections.latency import Age, Latency
from robsim.world.imperfections.noise import Deviation, PixelNoise
from robsim.world.imperfections.occlusions import Hidden, Occlusions
from robsim.world.imperfections.outliers import Outliers, Share, Size
from robsim.world.imperfections.period import CameraPeriod, Period
from robsim.world.imperfections.quantisation import Quantisation, Step


@described
@dataclass(frozen=True)
class Sensing(Declared):
    """The errors of the images of a run; each is off by default, and they combine.

    Until the first late image comes, the image of the start is used. Coordinates of joints
    are never late. Random numbers are keyed by (seed, run) and step.

    >>> Sensing(noise=0.5, latency=0.04).noise
    0.5
    """

    SHORT: ClassVar[Mapping[type[ImageEffect], int]] = {  # the first stream of random numbers
        PixelNoise: 0,
        Quantisation: 0,
        Outliers: 1,
        Occlusions: 0,
        DroppedImages: 3,
        Latency: 0,
        CameraPeriod: 0,
    }

    noise: Deviation = 0.0
    quantisation: Step = 0.0
    outliers: Share = 0.0
    outlier_size: Size = 50.0
    occlusions: Hidden = ()
    dropped: Dropped = 0.0
    latency: Age = 0.0
    period: Period = None
    effects: Annotated[
        tuple[ImageEffect | OwnImageEffect, ...],
        ListOf(EFFECT, most=64, alone=True),
        "Effects of other kinds, or of a kind of your own, one after the other.",
    ] = ()

    def acting(self) -> list[Acting[ImageEffect]]:
        """Return the imperfections that are on, in the order of the fields."""
        return acting(self, self.SHORT, image_effect, FIRST_STREAM)

    def timing(self, dt: float) -> ImageTiming:
        """Return when images are taken and used; InputError if that does not fit the period."""
        every = (each.effect.timing(dt) for each in self.acting())
        return reduce(ImageTiming.and_also, every, ImageTiming())
