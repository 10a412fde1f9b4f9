"""Outliers: mismatched marks, seen far from their true pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import Number, PerRun, register
from robsim.kernels.images import pixel_noise as kernels
from robsim.world.imperfections.image_effect import ImageEffect, ImageRows
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.noise import NOISE_PIXELS

SHARE = Number(least=0, below=1)
OutlierShare = Annotated[
    float, SHARE, PerRun(()), "Share of the marks that are mismatched in each image."
]
OutlierSize = Annotated[
    float, NOISE_PIXELS, PerRun(()), "Standard deviation of the displacement of an outlier."
]


@register("image effect", "outliers")
@dataclass(frozen=True)
class Outliers(ImageEffect):
    """A share of the marks is mismatched, with other outliers in each image.

    Without robust weights a share p of outliers with deviation s acts as noise of deviation sqrt(p)
    s.

    Examples
    --------
    >>> round(Outliers(0.04, 50.0).deviation(robust=False), 3)
    10.0
    """

    stream: ClassVar[int] = 1
    title: ClassVar[str] = "outliers"
    left_out: ClassVar[str] = ""
    outliers: OutlierShare = 0.1
    outlier_size: OutlierSize = 50.0

    def add_stages(self, image: ImageRows) -> None:
        image.program.add(
            kernels.mismatch_marks,
            every=image.every,
            pixels=image.own_pixels(),
            share=image.program.number(self.outliers),
            deviation=image.program.number(self.outlier_size),
            **image.key,
        )

    def deviation(self, robust: bool) -> float:
        return 0.0 if robust else math.sqrt(self.outliers) * self.outlier_size

    def caveats(self, robust: bool, noise: float) -> Iterator[str]:
        if robust:
            yield "outliers have no part in the noise, as if robust weights left out all of them"

    def stated(self, facts: RunFacts) -> Statement:
        sentence = (
            f"Outliers: {100 * self.outliers:.3g} percent of the marks are seen about "
            f"{self.outlier_size:.3g} px from where they are"
        )
        sentence += ", though robust weights are in use." if facts.robust else "."
        return sentence, {"share": self.outliers, "outlier_px": self.outlier_size}
