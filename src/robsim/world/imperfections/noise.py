"""Gaussian noise of pixel coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.base.arrays import Array
from robsim.declare import Number, PerRun, register
from robsim.kernels.images import pixel_noise as kernels
from robsim.world.imperfections.image_effect import ImageEffect, ImageRows
from robsim.world.imperfections.imperfection import RunFacts, Statement

NOISE_PIXELS = Number(least=0, unit="px")
NoiseDeviation = Annotated[
    float,
    NOISE_PIXELS,
    PerRun(()),
    "Standard deviation of Gaussian noise on each pixel coordinate.",
]


@register("image effect", "noise")
@dataclass(frozen=True)
class PixelNoise(ImageEffect):
    """Independent Gaussian noise on both pixel coordinates of each mark.

    Examples
    --------
    >>> PixelNoise(0.5).deviation(robust=False)
    0.5
    """

    title: ClassVar[str] = "pixel noise"
    noise: NoiseDeviation = 1.0

    def add_stages(self, image: ImageRows) -> None:
        program, before = image.program, image.pixels
        options = {"every": image.every, "pixels": before, "sigma": program.number(self.noise)}
        program.add(kernels.add_pixel_noise, **options, **image.key, out=image.new_pixels())

    def deviation(self, robust: bool) -> float:
        return self.noise

    def stated(self, facts: RunFacts) -> Statement:
        what = f"There is pixel noise of {self.noise:.3g} px"
        return facts.state_final_error(what, noise_px=self.noise)

    def in_views(self, pixels: Array, normal: Callable[[], Array]) -> Array:
        return pixels + self.noise * normal()
