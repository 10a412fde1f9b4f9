"""Dropped images: a share of the images never arrives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import PerRun, register
from robsim.kernels.images import pixel_noise as kernels
from robsim.world.imperfections.image_effect import (
    ImageEffect,
    ImageEffectStage,
    ImageRows,
    ImageTiming,
)
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.outliers import SHARE

DroppedShare = Annotated[
    float, SHARE, PerRun(()), "Share of the images that are lost; the one before is used again."
]


@register("image effect", "dropped")
@dataclass(frozen=True)
class DroppedImages(ImageEffect):
    """A share of the images that are lost on their way; the one before is used again.

    >>> DroppedImages(0.1).cause(0.04)
    '10 % of lost images'
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.LOST
    stream: ClassVar[int] = 3
    title: ClassVar[str] = "lost images"
    dropped: DroppedShare = 0.1

    def add_stages(self, image: ImageRows) -> None:
        given = {"every": image.every, "share": image.program.number(self.dropped)}
        image.program.add(kernels.lose_image, **given, **image.key, out=image.lost)

    def timing(self, dt: float) -> ImageTiming:
        return ImageTiming(lost=self.dropped)

    def cause(self, dt: float) -> str:
        return f"{100 * self.dropped:.3g} % of lost images"

    def stated(self, facts: RunFacts) -> Statement:
        sentence = f"{100 * self.dropped:.3g} percent of the images are lost."
        return sentence, {"share": self.dropped}
