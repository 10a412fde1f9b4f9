"""When images are taken and used, and how joints follow: the times of a loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

from robsim.base.errors import InputError
from robsim.engine.image_stream import ROUNDING
from robsim.run.experiment import Experiment

LONGEST = 1000  # control periods from one image to the next, or until it is used
MOST_LOST = 0.9  # share of images: of more, the mean square tells little of a run
LONGEST_QUEUE = (
    20  # images on their way, above which a loop of rarer images stands for the true one,
)
LONGEST_LOSSY_QUEUE = 6  # and where some are lost


@dataclass(frozen=True)
class LoopDelays:
    """The times of a loop in seconds: a command each `dt`, an image in each `every`-th period.

    Images are used `latency` after they were taken, a share `lost` of them never; joints follow
    with a time constant `lag`.
    """

    dt: float
    every: int = 1
    latency: float = 0.0
    lag: float = 0.0
    lost: float = 0.0

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Return the times of an experiment; InputError if images are too rare, late or lossy."""
        dt, scene = experiment.dt, experiment.scene
        every, latency, lost = experiment.sensing.timing(dt)
        if max(every, latency / dt) > LONGEST:
            raise InputError(
                f"advise: images are used up to {LONGEST} control periods long or late, and these "
                f"are {max(every, latency / dt):g}"
            )
        if lost > MOST_LOST:
            raise InputError(f"advise: up to {MOST_LOST:g} of the images are lost, not {lost:g}")
        return cls(dt, every, latency, experiment.actuation.response(scene.nv).lag, lost)

    @property
    def period(self) -> float:
        """Seconds from one image to the next."""
        return self.dt * self.every

    @property
    def delay(self) -> int:
        """How many images come between that of an instant and that which is used then."""
        return math.ceil(self.latency / self.period - ROUNDING)

    @property
    def taken(self) -> float:
        """Seconds from an image's arrival to when that is taken which comes `delay` later."""
        return max(self.delay * self.period - self.latency, 0.0)

    @property
    def held(self) -> Self:
        """The same loop, of which the command is the same from one image to the next."""
        return replace(self, dt=self.period, every=1)

    @property
    def short(self) -> Self:
        """The same, or a loop of rarer images with the same mean delay, where many are on the way.

        A command that is held for T is late by T/2. The limit differs by some (T / latency)^2 / 24.
        """
        longer = math.ceil(self.delay / (LONGEST_LOSSY_QUEUE if self.lost else LONGEST_QUEUE))
        if longer <= 1:
            return self
        every = longer * self.every
        latency = self.latency - 0.5 * (every - self.every) * self.dt
        lost = self.lost / (self.lost + longer * (1.0 - self.lost))  # of the same mean age
        return replace(self, every=every, latency=latency, lost=lost)
