"""Lost images: a share of the images never arrives."""

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
    float, SHARE, PerRun(()), "Share of the images that are lost. The previous image is used again."
]


@register("image effect", "dropped")
@dataclass(frozen=True)
class DroppedImages(ImageEffect):
    """A share of the images is lost; the controller uses the previous image again.

    Examples
    --------
    >>> DroppedImages(0.1).cause(0.04)
    '10 % of lost images'
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.LOST
    stream: ClassVar[int] = 3
    title: ClassVar[str] = "lost images"
    dropped: DroppedShare = 0.1

    def add_stages(self, image: ImageRows) -> None:
        options = {"every": image.every, "share": image.program.number(self.dropped)}
        image.program.add(kernels.lose_image, **options, **image.key, out=image.lost)

    def timing(self, dt: float) -> ImageTiming:
        return ImageTiming(lost=self.dropped)

    def cause(self, dt: float) -> str:
        return f"{100 * self.dropped:.3g} % of lost images"

    def stated(self, facts: RunFacts) -> Statement:
        sentence = f"{100 * self.dropped:.3g} percent of the images are lost."
        return sentence, {"share": self.dropped}
