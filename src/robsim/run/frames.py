"""The images that reach the controller: late, rare, lost, hidden or wrong, run by run."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, some_runs
from robsim.base.errors import InputError, suggest
from robsim.kernels import loop as kernels
from robsim.kernels import sensing as wrong
from robsim.kernels.loop import Noise
from robsim.kernels.sight import Look
from robsim.run.drives import Drives, Held
from robsim.run.record import LONGEST
from robsim.servo.sight import Sight, joined
from robsim.world.sensing import Sensing

ROUNDING = 1e-9  # of a period: times that differ by less are one


class Frame(NamedTuple):
    """All marks of all sights in one image, the run last."""

    pixels: Array  # (N, 2, B) as measured
    depth: Array  # (N, B) true, when it was taken
    hidden: NDArray[np.bool_]  # (N, B) marks whose pixels are those that were seen last
    arrived: NDArray[np.int64]  # (B,) the step at which it came

    def of(self, rows: slice) -> Frame:
        """Some of the marks."""
        return Frame(self.pixels[rows], self.depth[rows], self.hidden[rows], self.arrived)

    def going(self, runs: NDArray[np.bool_]) -> Frame:
        """Some of the runs."""
        return Frame(
            some_runs(self.pixels, runs),
            some_runs(self.depth, runs),
            some_runs(self.hidden, runs),
            some_runs(self.arrived, runs),
        )


@dataclass
class Frames:
    """The images of a chunk of runs, from one instant to the next."""

    sensing: Sensing
    sights: tuple[Sight, ...]
    drives: Drives
    dt: float
    past: deque[Held] = field(init=False)
    last: Frame | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.every = self.sensing.periods(self.dt)
        periods = min(self.sensing.latency / self.dt, 2.0 * LONGEST)  # no run is longer
        self.age = int(np.ceil(periods - ROUNDING))  # whole periods, of which some share is over
        self.share = self.age - periods if self.age - periods > ROUNDING else 0.0
        self.past = deque(maxlen=max(self.age, 1))

    def at(self, step: int, look: Look, noise: Noise) -> Frame:
        """The image that the controller has at a step, where all marks are as in `look`."""
        if self.last is None or step % self.every == 0:
            self.last = self._arrived(step, self._then(step, look), noise)
        return self.last

    def old(self, step: int) -> NDArray[np.int64] | int:
        """(B,) periods since the image was taken that is used at a step, rounded up."""
        return 0 if self.last is None else step - self.last.arrived + self.age

    def note(self, held: Held) -> None:
        """Remember where a period began and what was commanded in it."""
        if self.age:
            self.past.append(held)

    def without(self, over: NDArray[np.bool_]) -> Frames:
        """Those of the runs that go on."""
        rest = Frames(self.sensing, self.sights, self.drives, self.dt)
        rest.past.extend(Held(*(some_runs(part, ~over) for part in held)) for held in self.past)
        rest.last = self.last and self.last.going(~over)
        return rest

    def _then(self, step: int, look: Look) -> Look:
        """Where all marks were when the image was taken; at the start, if it is older."""
        if not self.past:
            return look
        q = self.past[0].q
        if step >= self.age:
            q = self.drives.moved(self.past[0], self.share * self.dt, self.dt)
        return joined([sight.look(q) for sight in self.sights], q.shape[1])

    def _arrived(self, step: int, look: Look, noise: Noise) -> Frame:
        pixels = np.empty_like(look.pixels)
        kernels.measure(look.pixels, noise, step, pixels)
        self._spoil(step, noise, pixels)
        runs = noise.runs.size
        hidden = np.repeat(self._hidden(step)[:, None], runs, axis=1)
        new = Frame(pixels, look.depth, hidden, np.full(runs, step))
        return new if self.last is None else self._kept(new, self.last, step, noise)

    def _spoil(self, step: int, noise: Noise, pixels: Array) -> None:
        told, who = self.sensing, (noise.seed, noise.runs, step)
        if told.outliers:
            wrong.displace(told.outliers, told.outlier_size, *who, pixels)
        if told.quantisation:
            wrong.quantise(told.quantisation, pixels)

    def _hidden(self, step: int) -> NDArray[np.bool_]:
        """(N,): which marks something hid when the image was taken."""
        seconds = max(step * self.dt - self.sensing.latency, 0.0)
        each = [np.zeros(0, dtype=np.bool_)]
        for sight in self.sights:
            hidden = np.zeros(len(sight.target.marks), dtype=np.bool_)
            for occlusion in self.sensing.occlusions:
                if occlusion.hides(seconds, *sight.key):
                    hidden[list(occlusion.marks)] = True
            each.append(hidden)
        return np.concatenate(each)

    def _kept(self, new: Frame, last: Frame, step: int, noise: Noise) -> Frame:
        """The new image, with what is hidden or lost as in the one before."""
        pixels = np.where(new.hidden[:, None], last.pixels, new.pixels)
        new = new._replace(pixels=pixels, depth=np.where(new.hidden, last.depth, new.depth))
        if not self.sensing.dropped:
            return new
        lost = np.empty(noise.runs.size, dtype=np.bool_)
        wrong.lost(self.sensing.dropped, noise.seed, noise.runs, step, lost)
        return Frame(*(np.where(lost, old, now) for old, now in zip(last, new, strict=True)))


def check_sensing(sensing: Sensing, sights: Sequence[Sight], dt: float) -> None:
    """InputError if an occlusion hides what does not exist, or periods do not fit."""
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
