"""Hypotheses on the times of images: a delay, wrong stamps, or a wrong clock."""

from __future__ import annotations

from collections.abc import Iterator

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.log_faults.hypothesis import Hypothesis
from robsim.analysis.log_faults.image_comparison import ImageComparison
from robsim.analysis.log_faults.log_images import ImageSeries
from robsim.analysis.log_faults.value_text import format_interval
from robsim.base.arrays import Array

EARLIEST, LATEST = -12, 25  # first values of a delay, in periods
ABOUT = "image times"


def list_time_hypotheses(
    images: ImageComparison, camera: str, dt: float, latency: float
) -> Iterator[Hypothesis]:
    """Yield the hypotheses on the times of a camera's images: a delay, and a delay that grows.

    The delay `latency` (s) is declared in the experiment; `dt` is the period.
    """
    times = images.find(camera).times
    span = float(times[-1] - times[0])

    def delay(one: ImageSeries, values: Array) -> Array:
        rate = values[1] if len(values) > 1 else 0.0
        return one.predict(times=one.times - values[0] - rate * (one.times - times[0]))

    def describe(values: Array, half: Array) -> str:
        how = "older" if values[0] > 0 else "newer"
        why = "a delay of the images, or wrong stamps" if values[0] > 0 else "wrong stamps"
        seconds = format_interval(abs(values[0]), half[0], "s")
        periods = format_number(abs(values[0]) / dt)
        rate = ""
        if len(values) > 1:
            rate = f" at first, and by {format_interval(values[1], half[1])} s per second more"
        return (
            f"the images of '{camera}' are {seconds} ({periods} periods) {how} than their times in "
            f"the log{rate}: {why}"
        )

    def size(values: Array) -> float:
        drift = values[-1] * span if len(values) > 1 else 0.0
        return float(max(abs(values[0] - latency), abs(values[0] - latency + drift))) / dt

    grid = [(k * dt,) for k in range(EARLIEST, LATEST + 1)]
    drifts = [(*each, 0.0) for each in grid]
    common = ABOUT, delay, describe, camera, camera
    path = "sensing.latency"
    yield images.make(*common, ("delay_s",), grid, size=size, path=path)
    yield images.make(*common, ("delay_s", "rate"), drifts, size=size, path=path)
