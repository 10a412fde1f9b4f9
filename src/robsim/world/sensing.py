"""The errors of the images that a controller gets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce

from robsim.declare import Declared, described
from robsim.world.imperfections.dropped import Dropped, DroppedImages
from robsim.world.imperfections.image_effect import FIRST_STREAM, Effects, ImageEffect, ImageTiming
from robsim.world.imperfections.imperfection import Acting, acting
from robsim.world.imperfections.latency import Age, Latency
from robsim.world.imperfections.noise import Deviation, PixelNoise
from robsim.world.imperfections.occlusion import Hidden
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

    noise: Deviation = 0.0
    quantisation: Step = 0.0
    outliers: Share = 0.0
    outlier_size: Size = 50.0
    occlusions: Hidden = ()
    dropped: Dropped = 0.0
    latency: Age = 0.0
    period: Period = None
    effects: Effects = ()

    def acting(self) -> list[Acting[ImageEffect]]:
        """Return the imperfections that are on, in the order of the fields."""
        return self._acting

    @cached_property
    def _acting(self) -> list[Acting[ImageEffect]]:
        return acting(self, PARTS, ImageEffect, FIRST_STREAM)

    def timing(self, dt: float) -> ImageTiming:
        """Return when images are taken and used; InputError if that does not fit the period."""
        every = (each.effect.timing(dt) for each in self.acting())
        return reduce(ImageTiming.and_also, every, ImageTiming())


PARTS = (
    *(PixelNoise, Quantisation, Outliers, "occlusions", DroppedImages, Latency, CameraPeriod),
    "effects",
)
