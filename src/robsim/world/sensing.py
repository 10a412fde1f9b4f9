"""The errors of the images that a controller receives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING

from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import DeclaredValue, described
from robsim.world.imperfections.image_effect import (
    FIRST_STREAM,
    ImageEffect,
    ImageEffectList,
    ImageTiming,
    OwnImageEffect,
)
from robsim.world.imperfections.image_loss import DroppedImages, DroppedShare
from robsim.world.imperfections.imperfection import ActiveImperfection, list_active_imperfections
from robsim.world.imperfections.latency import ImageLatency, Latency
from robsim.world.imperfections.noise import NoiseDeviation, PixelNoise
from robsim.world.imperfections.occlusion import Occlusion, OcclusionList
from robsim.world.imperfections.outliers import Outliers, OutlierShare, OutlierSize
from robsim.world.imperfections.period import CameraPeriod, CameraPeriodTime
from robsim.world.imperfections.quantisation import Quantisation, QuantisationStep


@described
@dataclass(frozen=True)
class Sensing(DeclaredValue):
    """The errors of the images that a controller receives.

    Every error is off by default, and errors combine: noise, rounding and mismatched marks change
    the pixels; occlusions hide marks; lost, late and rare images delay the information of the
    control loop. The coordinates of joints have no delay. Until the first late image arrives, the
    controller uses the image at the start. Random numbers are keyed by (seed, run) and step, so
    that a run has the same noise alone and in any batch.

    Examples
    --------
    >>> Sensing(noise=0.5, latency=0.04).noise
    0.5
    """

    noise: NoiseDeviation = 0.0
    quantisation: QuantisationStep = 0.0
    outliers: OutlierShare = 0.0
    outlier_size: OutlierSize = 50.0
    occlusions: OcclusionList = ()
    dropped: DroppedShare = 0.0
    latency: ImageLatency = 0.0
    period: CameraPeriodTime = None
    effects: ImageEffectList = ()

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            noise: float = 0.0,
            quantisation: float = 0.0,
            outliers: float = 0.0,
            outlier_size: float = 50.0,
            occlusions: Occlusion | Sequence[Occlusion] = (),
            dropped: float = 0.0,
            latency: float = 0.0,
            period: float | None = None,
            effects: ImageEffect | OwnImageEffect | Sequence[ImageEffect | OwnImageEffect] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.latency, "Sensing.latency")
        warn_of_milliseconds(self.period, "Sensing.period")

    def list_active(self) -> list[ActiveImperfection[ImageEffect]]:
        """Return the imperfections that are switched on, in the order of the fields."""
        return self._acting

    @cached_property
    def _acting(self) -> list[ActiveImperfection[ImageEffect]]:
        return list_active_imperfections(self, SENSING_PARTS, ImageEffect, FIRST_STREAM)

    def timing(self, dt: float) -> ImageTiming:
        """Return the timing of images; raise InputError if it does not fit the period dt."""
        every = (each.effect.timing(dt) for each in self.list_active())
        return reduce(ImageTiming.and_also, every, ImageTiming())


SENSING_PARTS = (
    *(PixelNoise, Quantisation, Outliers, "occlusions", DroppedImages, Latency, CameraPeriod),
    "effects",
)
