"""The images that reach the controller: late, rare, lost, hidden or wrong, run by run."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, some_runs
from robsim.base.errors import InputError, suggest
from robsim.kernels import sensing as kernels
from robsim.run.drives import Drives, Period
from robsim.run.record import LONGEST
from robsim.servo.sight import Sight, joined
from robsim.world.effects import FIRST_STREAM, Exposure, changed
from robsim.world.sensing import Sensing

ROUNDING = 1e-9  # of a period: times that differ by less are one


class Noise(NamedTuple):
    """Pixel noise: standard deviation, seed, and the numbers of the runs."""

    sigma: float
    seed: Any  # uint64
    runs: Any  # (B,) uint64


class Marks(NamedTuple):
    """The true marks of all sights, with the run last."""

    pixels: Array  # (N, 2, B)
    depth: Array  # (N, B)


class Image(NamedTuple):
    """The marks of all sights in one image, with the run last."""

    pixels: Array  # (N, 2, B) as measured
    depth: Array  # (N, B) true, when it was taken
    hidden: NDArray[np.bool_]  # (N, B) marks whose pixels are those that were seen last
    arrived: NDArray[np.int64]  # (B,) the step at which it came

    def going(self, runs: NDArray[np.bool_]) -> Image:
        """Return the image of some of the runs."""
        return Image(
            some_runs(self.pixels, runs),
            some_runs(self.depth, runs),
            some_runs(self.hidden, runs),
            some_runs(self.arrived, runs),
        )


@dataclass
class ImageStream:
    """The images of a chunk of runs, from one instant to the next."""

    sensing: Sensing
    sights: tuple[Sight, ...]
    drives: Drives
    dt: float
    past: deque[Period] = field(init=False)
    last: Image | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.every = self.sensing.periods(self.dt)
        periods = min(self.sensing.latency / self.dt, 2.0 * LONGEST)  # no run is longer
        self.delay = int(np.ceil(periods - ROUNDING))  # whole periods, of which some share is over
        self.share = self.delay - periods if self.delay - periods > ROUNDING else 0.0
        self.past = deque(maxlen=max(self.delay, 1))

    def at(self, step: int, marks: Marks, noise: Noise) -> Image:
        """Return the image that the controller has at a step, with the marks where they are."""
        if self.last is None or step % self.every == 0:
            self.last = self._arrived(step, self._then(step, marks), noise)
        return self.last

    def age(self, step: int) -> NDArray[np.int64] | int:
        """Return the age (B,) in periods, rounded up, of the image that is used at a step."""
        return 0 if self.last is None else step - self.last.arrived + self.delay

    def note(self, period: Period) -> None:
        """Remember where a period began and what was commanded in it."""
        if self.delay:
            self.past.append(period)

    def without(self, over: NDArray[np.bool_]) -> ImageStream:
        """Return the stream of the runs that go on."""
        rest = ImageStream(self.sensing, self.sights, self.drives, self.dt)
        rest.past.extend(period.without(over) for period in self.past)
        rest.last = self.last and self.last.going(~over)
        return rest

    def _then(self, step: int, marks: Marks) -> Marks:
        """Return the marks when the image was taken, or at the start if it is older."""
        if not self.past:
            return marks
        q = self.past[0].q
        if step >= self.delay:
            q = self.drives.moved(self.past[0], self.share * self.dt, self.dt)
        seen = joined([sight.project(q) for sight in self.sights], q.shape[1])
        return Marks(seen.pixels, seen.depth)

    def _arrived(self, step: int, marks: Marks, noise: Noise) -> Image:
        pixels = np.empty_like(marks.pixels)
        kernels.disturb(marks.pixels, noise.sigma, noise.seed, noise.runs, step, pixels)
        self._add_imperfections(step, noise, pixels)
        runs = noise.runs.size
        hidden = np.repeat(self._hidden(step)[:, None], runs, axis=1)
        new = Image(pixels, marks.depth, hidden, np.full(runs, step))
        return new if self.last is None else self._kept(new, self.last, step, noise)

    def _add_imperfections(self, step: int, noise: Noise, pixels: Array) -> None:
        """Displace outliers, then round, in place."""
        sensing, key = self.sensing, (noise.seed, noise.runs, step)
        if sensing.outliers:
            kernels.displace(sensing.outliers, sensing.outlier_size, *key, pixels)
        if sensing.effects:
            self._add_effects(step, noise, pixels)
        if sensing.quantisation:
            kernels.quantise(sensing.quantisation, pixels)

    def _add_effects(self, step: int, noise: Noise, pixels: Array) -> None:
        """Let the user's effects change the marks of each sight, in place."""
        seconds, row = max(step * self.dt - self.sensing.latency, 0.0), 0
        for sight in self.sights:
            rows = slice(row, row + len(sight.target.marks))
            for i, effect in enumerate(self.sensing.effects):
                stream = FIRST_STREAM + 2 * i
                shot = Exposure(seconds, *sight.key, step, noise.seed, noise.runs, stream)
                pixels[rows] = changed(effect, pixels[rows], shot)
            row = rows.stop

    def _hidden(self, step: int) -> NDArray[np.bool_]:
        """Return (N,): which marks an occlusion hid when the image was taken."""
        seconds = max(step * self.dt - self.sensing.latency, 0.0)
        each = [np.zeros(0, dtype=np.bool_)]
        for sight in self.sights:
            hidden = np.zeros(len(sight.target.marks), dtype=np.bool_)
            for occlusion in self.sensing.occlusions:
                if occlusion.hides(seconds, *sight.key):
                    hidden[list(occlusion.marks)] = True
            each.append(hidden)
        return np.concatenate(each)

    def _kept(self, new: Image, last: Image, step: int, noise: Noise) -> Image:
        """Return the new image, with what is hidden or lost as in the one before."""
        pixels = np.where(new.hidden[:, None], last.pixels, new.pixels)
        new = new._replace(pixels=pixels, depth=np.where(new.hidden, last.depth, new.depth))
        if not self.sensing.dropped:
            return new
        lost = np.empty(noise.runs.size, dtype=np.bool_)
        kernels.lost(self.sensing.dropped, noise.seed, noise.runs, step, lost)
        return Image(*(np.where(lost, old, now) for old, now in zip(last, new, strict=True)))


def check_sensing(sensing: Sensing, sights: Sequence[Sight], dt: float) -> None:
    """Raise InputError if an occlusion hides what does not exist, or periods do not fit."""
    sensing.periods(dt)
    for occlusion in sensing.occlusions:
        for i, kind in enumerate(("camera", "target")):
            name, known = getattr(occlusion, kind), sorted({sight.key[i] for sight in sights})
            if name is not None and name not in known:
                hint = suggest(name, known, f"{kind}s of the task")
                raise InputError(f"occlusion: the task has no {kind} {name!r}; {hint}")
        for sight in sights:
            mine = occlusion.hides(occlusion.start, *sight.key)
            if mine and max(occlusion.marks) >= len(sight.target.marks):
                raise InputError(
                    f"occlusion: '{sight.target.name}' has {len(sight.target.marks)} marks, "
                    f"numbered from 0; there is no {max(occlusion.marks)}"
                )
