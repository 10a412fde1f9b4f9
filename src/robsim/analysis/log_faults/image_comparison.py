"""Images of a log beside their prediction by the scene, as signals for hypotheses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.analysis.log_faults.hypothesis import Hypothesis
from robsim.analysis.log_faults.log_images import ImageSeries, join_series
from robsim.base.arrays import Array

LEAST_OFFSET = 0.5  # rms distance in pixels of the marks above which a fault is reported

SeriesChange = Callable[[ImageSeries, Array], Array]  # pixels (n, N, 2) of a series, from numbers


@dataclass(frozen=True, eq=False)
class ImageComparison:
    """The images of all cameras and targets of a log, and their prediction by the scene."""

    series: Sequence[ImageSeries]

    @cached_property
    def observed(self) -> Array:
        """The observed pixels (n, M) of all series, side by side."""
        return join_series([each.pixels for each in self.series])

    @cached_property
    def predicted(self) -> Array:
        """The pixels (n, M) that the scene predicts."""
        return join_series([each.pixels_of_scene for each in self.series])

    @property
    def healthy(self) -> Hypothesis:
        """The hypothesis without a fault."""
        return Hypothesis("no fault", "", lambda values: self.predicted, lambda *_: "no fault")

    def find(self, name: str) -> ImageSeries:
        """Return the first series of a camera or target."""
        return next(each for each in self.series if name in each.sight.key)

    def make(
        self,
        about: str,
        change: SeriesChange,
        describe: Callable[[Array, Array], str],
        part: str = "",
        only: str = "",
        names: tuple[str, ...] = (),
        starts: Sequence[Sequence[float]] = (),
        cost: int = 0,
        size: Callable[[Array], float] | None = None,
        path: str = "",
        correct: Callable[[Array, Array], Array] | None = None,
    ) -> Hypothesis:
        """Return a hypothesis that changes the series of a camera or target, or all series."""

        def predict(values: Array) -> Array:
            parts = [
                change(each, values) if only in ("", *each.sight.key) else each.pixels_of_scene
                for each in self.series
            ]
            return join_series(parts)

        first = starts or [(0.0,) * len(names)]
        measure = size or (lambda values: self._measure_change(predict(values)))
        return Hypothesis(
            about, part, predict, describe, names, first, measure, cost, path, correct
        )

    def _measure_change(self, pixels: Array) -> float:
        """Return the rms change of the marks by a fault, in units of the least that is reported."""
        offsets = (pixels - self.predicted)[np.isfinite(self.observed)]
        if not np.isfinite(offsets).all():
            return float("inf")
        return float(np.sqrt(2.0 * np.mean(offsets**2))) / LEAST_OFFSET
