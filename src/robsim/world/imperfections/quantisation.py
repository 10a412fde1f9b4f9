"""The resolution of an image: pixel coordinates rounded to a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import PerRun, register
from robsim.kernels.images import pixel_noise as kernels
from robsim.world.imperfections.image_effect import ImageEffect, ImageEffectStage, ImageRows
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.noise import NOISE_PIXELS

QuantisationStep = Annotated[float, NOISE_PIXELS, PerRun(()), "Rounding step of pixel coordinates."]
COARSE = 0.5  # ratio of noise to step, below which rounding does not act as noise


@register("image effect", "quantisation")
@dataclass(frozen=True)
class Quantisation(ImageEffect):
    """Pixel coordinates rounded to multiples of a step.

    Rounding to a step h adds an error with the variance h^2/12 of a uniform distribution.

    Examples
    --------
    >>> round(Quantisation(1.0).deviation(robust=False), 3)
    0.289
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.ROUNDED
    title: ClassVar[str] = "rounded pixels"
    quantisation: QuantisationStep = 1.0

    def add_stages(self, image: ImageRows) -> None:
        values, size = image.own_pixels().flat, image.program.number(self.quantisation)
        image.program.add(kernels.quantise_rows, every=image.every, values=values, size=size)

    def deviation(self, robust: bool) -> float:
        return self.quantisation / math.sqrt(12.0)

    def caveats(self, robust: bool, noise: float) -> Iterator[str]:
        if noise < COARSE * self.quantisation:
            yield "rounded pixels count as noise, and with less noise than this the loop may stick"

    def stated(self, facts: RunFacts) -> Statement:
        what = f"Pixels are rounded to {self.quantisation:.3g} px"
        return facts.state_final_error(what, quantisation_px=self.quantisation)

    def in_views(self, pixels: Array, normal: Callable[[], Array]) -> Array:
        step = self.quantisation
        return np.asarray(step * np.round(pixels / step) if step else pixels)
