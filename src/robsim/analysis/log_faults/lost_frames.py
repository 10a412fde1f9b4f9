"""Images of a log that are lost, repeated or old, and marks that are not seen."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.log_faults.hypothesis import COVERAGE
from robsim.analysis.log_faults.log_images import SAME_TIME
from robsim.base.arrays import Array
from robsim.servo.camera_target import CameraTarget

MOST_LOST = 0.25  # share of lost images; above it by more than its interval they are a finding
LONGEST_GAP, SHORTEST_GAP = 10, 0.25  # images and seconds of a gap that is a finding
UNSEEN = 0.1  # share of images without a mark above which this is a finding
OLD_IMAGE = 2.0  # age in periods above which an image is old
USUAL = 0.2  # quantile of the intervals of images that is their usual interval
MOVING = 1e-4  # rad or m in a period above which a joint moves
JUMP = 1.0  # pixels by which the image after a repeated image jumps


@dataclass(frozen=True, eq=False)
class FrameCount:
    """The images of a target by a camera in a log, one row for each period.

    `times` (T,) are the times of the images, `ages` (T,) their ages in seconds, and `pixels` (T, N,
    2) their marks, at the measured coordinates `q` (T, nq). `inside` (T,) is true if the target is
    well inside the image by the scene: an image without it is not lost. `period` (s), `latency` (s)
    and `dropped` are declared in the experiment.
    """

    sight: CameraTarget
    times: Array
    ages: Array
    pixels: Array
    q: Array
    inside: NDArray[np.bool_]
    dt: float
    period: float
    latency: float
    dropped: float

    @cached_property
    def new(self) -> NDArray[np.int64]:
        """The periods with a new image; an image with the pixels of the last is a repetition."""
        newer = np.diff(self.times, prepend=-np.inf) > SAME_TIME
        return np.flatnonzero(newer & ~self._repeated)

    @property
    def _repeated(self) -> NDArray[np.bool_]:
        """Whether (T,) an image repeats the pixels of a moving target to the last digit.

        The joints move meanwhile, and the pixels jump when the next image comes.
        """
        changes = np.abs(np.diff(self.pixels, axis=0)).max(axis=(1, 2), initial=0.0)
        same = np.concatenate([[False], changes == 0.0])
        moving = np.abs(np.diff(self.q, axis=0, prepend=self.q[:1])).max(axis=1) > MOVING
        following = np.append(np.flatnonzero(~same), len(same))
        after = following[np.searchsorted(following[:-1], np.arange(len(same)), side="right")]
        jumps = np.append(changes, 0.0)[after - 1]
        return np.asarray(same & moving & (jumps > JUMP))

    @cached_property
    def _gaps(self) -> tuple[Array, Array]:
        """The numbers of images lost between two images, and their intervals in seconds."""
        rows = self.new
        intervals = np.diff(self.times[rows])
        if not len(intervals):
            return np.empty(0), np.empty(0)
        usual = max(float(np.quantile(intervals, USUAL)), self.period, self.dt)
        lost = np.maximum(np.round(intervals / usual) - 1.0, 0.0)
        outside = np.concatenate([[0], np.cumsum(~self.inside)])
        inside = outside[rows[1:] + 1] == outside[rows[:-1]]
        return lost * inside, intervals * inside

    @property
    def share(self) -> float:
        """The share of images that are lost."""
        lost = float(self._gaps[0].sum())
        return lost / max(lost + len(self.new), 1.0)

    @property
    def is_usual(self) -> bool:
        """Whether the lost images are too few for a finding."""
        lost, seconds = self._gaps
        long = ((lost >= LONGEST_GAP) & (seconds >= SHORTEST_GAP)).any()
        error = COVERAGE * float(np.sqrt(self.share * (1.0 - self.share) / max(len(self.times), 1)))
        return not long and self.share - error <= max(MOST_LOST, 2.0 * self.dropped)

    def describe(self) -> str:
        """Return a sentence on the lost images."""
        camera, share = self.sight.eye.name, f"{100 * self.share:.2g} %"
        longest = format_number(float(self._gaps[1].max(initial=0.0)))
        return (
            f"Images of '{camera}' are lost: {share} of them, and the longest gap between two "
            f"images is {longest} s."
        )

    def findings(self) -> Iterator[Finding]:
        """Yield the findings on lost images and unseen marks."""
        if not self.is_usual:
            longest = float(self._gaps[1].max(initial=0.0))
            evidence = {"share": self.share, "longest_s": longest}
            yield Finding("lost images", self.describe(), evidence)
        unseen: NDArray[np.bool_] = np.isnan(self.pixels[self.new, :, 0])
        missing = unseen.mean(axis=0) if len(unseen) else np.zeros(self.pixels.shape[1])
        mark = int(np.argmax(missing))
        if missing[mark] > UNSEEN:
            text = (
                f"Mark {mark} of '{self.sight.target.name}' is not seen in "
                f"{100 * missing[mark]:.3g} % of the images."
            )
            yield Finding("unseen marks", text, {"share": float(missing[mark])})

    def report_age(self) -> Iterator[Finding]:
        """Yield a finding if most images are old when they come, by their own times."""
        age = float(np.median(self.ages[self.new])) - self.latency if len(self.new) else 0.0
        if age > OLD_IMAGE * self.dt:
            text = (
                f"The images of '{self.sight.eye.name}' are {format_number(age)} s "
                f"({format_number(age / self.dt)} periods) old when they come, by their times in "
                "the log."
            )
            yield Finding("old images", text, {"age_s": age})
