"""The delays of a loop: when images are taken and used, and how joints lag."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

from robsim.base.errors import InputError
from robsim.engine.image_stream import ROUNDING
from robsim.run.experiment import Experiment

LONGEST = 1000  # most control periods between two images, or from an image until its use
MOST_LOST = 0.9  # above this share the mean square no longer describes a single run
LONGEST_QUEUE = 20  # pending images above which rarer images approximate the loop
LONGEST_LOSSY_QUEUE = 6  # the same limit if some images are lost


@dataclass(frozen=True)
class LoopDelays:
    """Times of a loop in seconds: a command each `dt`, and an image in each `every`-th period.

    Images are used `latency` after they were taken, and a share `lost` of them is never used.
    Joints follow with a time constant `lag`.
    """

    dt: float
    every: int = 1
    latency: float = 0.0
    lag: float = 0.0
    lost: float = 0.0

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Return the times of an experiment; InputError for extreme delays."""
        dt, scene = experiment.dt, experiment.scene
        every, latency, lost = experiment.sensing.timing(dt)
        if max(every, latency / dt) > LONGEST:
            raise InputError(
                f"advise: interval and latency of the images: expected at most {LONGEST} control "
                f"periods, got {max(every, latency / dt):g}"
            )
        if lost > MOST_LOST:
            raise InputError(
                f"advise: at most {MOST_LOST:g} of the images may be lost, got {lost:g}"
            )
        return cls(dt, every, latency, experiment.actuation.response(scene.nv).lag, lost)

    @property
    def period(self) -> float:
        """The time in seconds from one image to the next."""
        return self.dt * self.every

    @property
    def delay(self) -> int:
        """The number of images taken after the image that is used now."""
        return math.ceil(self.latency / self.period - ROUNDING)

    @property
    def time_until_use(self) -> float:
        """The time in seconds from an arrival until the image used `delay` later is taken."""
        return max(self.delay * self.period - self.latency, 0.0)

    @property
    def per_image(self) -> Self:
        """The same loop with a command that is constant from one image to the next."""
        return replace(self, dt=self.period, every=1)

    @property
    def with_rarer_images(self) -> Self:
        """The same loop, or a loop with rarer images if many images are pending.

        The rarer images have the same mean delay: a command that is held for T is late by T/2. The
        limits of both loops differ by about (T / latency)^2 / 24, relative to the limit.
        """
        longer = math.ceil(self.delay / (LONGEST_LOSSY_QUEUE if self.lost else LONGEST_QUEUE))
        if longer <= 1:
            return self
        every = longer * self.every
        latency = self.latency - 0.5 * (every - self.every) * self.dt
        # the same mean age of the images
        lost = self.lost / (self.lost + longer * (1.0 - self.lost))
        return replace(self, every=every, latency=latency, lost=lost)
