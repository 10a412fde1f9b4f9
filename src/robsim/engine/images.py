"""The images that reach the controller: late, rare, lost, hidden or wrong, run by run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from robsim.base.arrays import Array, is_any
from robsim.base.errors import InputError, suggest
from robsim.base.room import room
from robsim.engine.plant import Plant
from robsim.engine.record import SMALL
from robsim.kernels.control.commanding import copied
from robsim.kernels.images import hiding, late
from robsim.kernels.images import sensing as kernels
from robsim.kernels.images.viewing import EACH, FIRST, MORE
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.placed import Placed
from robsim.servo.given import View, view
from robsim.servo.sight import Key, Sight
from robsim.world.effects import FIRST_STREAM, Exposure, changed
from robsim.world.sensing import Sensing

ROUNDING = 1e-9  # of a period: times that differ by less are one
TOGETHER = 256  # runs of a chunk, unless others are asked for


class Images:
    """The rows of a program with the images that the controller gets, and the stages of them.

    `true` is the first row of the image of this instant, as it truly is, and `seen` that of the
    same without marks that are out of the image, where these are excused. `pixels` and `depth` are
    from `deliver` on those of the image that is used. `hidden` has a row for each mark, or is
    -1, and `age` is that of the image in periods, rounded up.
    """

    def __init__(
        self,
        program: Program,
        plant: Plant,
        sights: tuple[Sight, ...],
        sensing: Sensing,
        steps: int,
        key: tuple[np.uint64, int],
        excused: frozenset[Key],
    ) -> None:
        self.program, self.plant, self.sights, self.sensing = program, plant, sights, sensing
        self.seed, self.run = key
        self._key = int(self.seed.astype(np.int64)), self.run  # as stages take it
        counts = [len(sight.target.marks) for sight in sights]
        self.marks = np.cumsum([0, *counts]).tolist()  # number of the first of each sight
        self.N, self.every = self.marks[-1], sensing.periods(plant.seconds)
        self.excused, self.true = excused, program.rows(3 * self.N)
        self.pixels = self.seen = program.rows(3 * self.N) if excused else self.true
        self.depth = self.pixels + 2 * self.N
        self.hidden, self.age = -1, program.constant(0.0)
        self.latency = program.number(sensing.latency)
        self.delays, shares = lateness(sensing.latency, plant.seconds, steps)
        self.length = _ring_length(self.delays, steps)
        self.delay, self._passes = program.number(self.delays), bool(shares.any())
        self.share, self.ahead = program.number(shares), program.number(shares * plant.seconds)

    @property
    def fresh(self) -> bool:
        """Whether the image that is used is always that of this instant."""
        return not (self.late or self._keeps)

    @property
    def late(self) -> bool:
        """Whether images need time to arrive."""
        return bool(self.delays.any())

    @property
    def _keeps(self) -> bool:
        """Whether an image, or some of its marks, may be used again."""
        s = self.sensing
        return bool(self.every > 1 or is_any(s.dropped) or s.occlusions)

    def remember(self) -> None:
        """Add the stages that keep the image of the period that ends, before the joints move."""
        if not self.late:
            return
        self.ring = self.program.rows(3 * self.N * self.length)
        between = self._between() if self._passes else self.seen
        rows = between, self.share, self.ring, self.length
        self.program.add(late.note, 3 * self.N, self.seen, *rows)

    def _between(self) -> int:
        """Add the stages of an image that is taken while a period passes; return its rows."""
        found = self.program.rows(3 * self.N)
        seen = self.program.rows(3 * self.N) if self.excused else found
        self.taken(self.plant.within(self.ahead), found, seen, self.program.rows())
        return seen

    def taken(self, placed: Placed, image: int, seen: int, status: int) -> list[View]:
        """Add the stages of an image of bodies that are placed, of what is seen, and its status."""
        found, of = [], FIRST
        for sight, first in zip(self.sights, self.marks, strict=False):
            count, at = len(sight.target.marks), (2 * first, 2 * self.N + first)
            rows, to = [image + n for n in at], [seen + n for n in at]
            if sight.key in self.excused:
                each = self.program.rows(count)
                found.append(view(self.program, placed, sight, *rows, each, of=EACH))
                self.program.add(hiding.lack, count, *rows, each, *to)
                continue
            found.append(view(self.program, placed, sight, *rows, status, of=of))
            of = MORE
            if seen != image:
                self.program.add(copied, 2 * count, rows[0], to[0])
                self.program.add(copied, count, rows[1], to[1])
        return found

    def rows(self, first: int) -> tuple[int, int, int]:
        """Return the rows of pixels, depths and whether they are hidden, of marks from a first."""
        hidden = self.hidden + first if self.hidden >= 0 else -1
        return self.pixels + 2 * first, self.depth + first, hidden

    def deliver(self) -> None:
        """Add the stages from the true image to the one that is used."""
        if self.late:
            self._recall()
        self._spoil()
        if self._keeps:
            self._receive()

    def _recall(self) -> None:
        """Let the image be one that was taken some time ago."""
        program, count = self.program, 3 * self.N
        first, out = program.rows(count), program.rows(count)
        rows = self.seen, first, self.ring, self.length, self.delay, out
        program.add(late.recall, self.every, count, *rows)
        self.pixels, self.depth, self.age = out, out + 2 * self.N, self.delay

    def _spoil(self) -> None:
        """Add noise, displace outliers, let the user's effects change marks, and round, in turn."""
        s, number, add = self.sensing, self.program.number, self.program.add
        count, found = 2 * self.N, self.program.rows(2 * self.N)
        rounds, strays = is_any(s.quantisation), is_any(s.outliers)
        if is_any(s.noise):
            rows = self.pixels, number(s.noise), *self._key, found
            add(kernels.blur, self.every, self.N, *rows)
        elif strays or s.effects or rounds:
            add(copied, count, self.pixels, found)
        else:
            return
        self.pixels = found
        if strays:
            rows = found, number(s.outliers), number(s.outlier_size), *self._key
            add(kernels.displace, self.every, self.N, *rows)
        if s.effects:
            self.program.call(partial(self._change, found))
        if rounds:
            add(kernels.quantise, self.every, count, found, number(s.quantisation))

    def _change(self, first: int, blocks: Blocks, step: int) -> None:
        """Let the user's effects change the marks of each sight."""
        if step % self.every:
            return
        pixels = blocks.get(first, self.N, 2)
        runs = blocks.get(self.run, 1)[0].view(np.uint64)
        seconds = max(step * self.plant.seconds - self.sensing.latency, 0.0)
        for sight, pair in zip(self.sights, pairwise(self.marks), strict=True):
            rows = slice(*pair)
            for i, effect in enumerate(self.sensing.effects):
                stream = FIRST_STREAM + 2 * i
                shot = Exposure(seconds, *sight.key, step, self.seed, runs, stream)
                pixels[rows] = changed(effect, pixels[rows], shot)
        blocks.put(first, pixels)

    def _receive(self) -> None:
        """Let lost images, hidden marks and the time between images leave what was there before."""
        program, N, hides, lost = self.program, self.N, self._hides(), self.program.rows()
        if is_any(self.sensing.dropped):
            share = program.number(self.sensing.dropped)
            program.add(kernels.lose, self.every, share, *self._key, lost)
        taken, hidden, age = program.rows(3 * N), program.rows(N), program.rows()
        given = self.pixels, self.depth, hides, lost, self.delay
        program.add(late.receive, self.every, N, *given, taken, taken + 2 * N, hidden, age)
        self.pixels, self.depth, self.age = taken, taken + 2 * N, age
        self.hidden = hidden if self.sensing.occlusions else -1

    def _hides(self) -> int:
        """Return the rows of whether each mark is hidden in an image that arrives now."""
        program, occlusions = self.program, self.sensing.occlusions
        found, numbers = program.rows(self.N), []
        for each in occlusions:
            marks = [
                first + mark
                for sight, first in zip(self.sights, self.marks, strict=False)
                if each.concerns(*sight.key)
                for mark in each.marks
            ]
            numbers += [program.constant([each.start, each.end]), len(marks), *marks]
        if occlusions:
            rows = found, self.plant.dt, self.latency, len(occlusions)
            program.add(hiding.hide, self.N, *rows, *numbers)
        return found


def lateness(latency: float | Array, dt: float, steps: int) -> tuple[Array, Array]:
    """Return in how many whole periods images come, and which share of the first passes before.

    An image that comes after the last step is as late as any other that does.
    """
    if not is_any(latency):
        return np.zeros(1), np.zeros(1)
    periods = np.minimum(np.atleast_1d(latency) / dt, steps + 1.0)
    delay = np.ceil(periods - ROUNDING)
    share = delay - periods
    return delay, np.where(share > ROUNDING, share, 0.0)


def check_sensing(
    sensing: Sensing, sights: Sequence[Sight], dt: float, steps: int, runs: int
) -> None:
    """Raise InputError if an occlusion hides what does not exist, or times do not fit."""
    sensing.periods(dt)
    delays, _ = lateness(sensing.latency, dt, steps)
    _check_memory(sensing, sights, _ring_length(delays, steps), runs)
    for occlusion in sensing.occlusions:
        for i, kind in enumerate(("camera", "target")):
            name, known = getattr(occlusion, kind), sorted({sight.key[i] for sight in sights})
            if name is not None and name not in known:
                hint = suggest(name, known, f"{kind}s of the task")
                raise InputError(f"occlusion: the task has no {kind} {name!r}; {hint}")
        for sight in sights:
            mine = occlusion.concerns(*sight.key)
            if mine and max(occlusion.marks) >= len(sight.target.marks):
                raise InputError(
                    f"occlusion: '{sight.target.name}' has {len(sight.target.marks)} marks, "
                    f"numbered from 0; there is no {max(occlusion.marks)}"
                )


def _ring_length(delays: Array, steps: int) -> int:
    """Return how many past images are kept: none for what does not arrive before the end."""
    return int(np.where(delays > steps, 0.0, delays).max(initial=1.0))


def _check_memory(sensing: Sensing, sights: Sequence[Sight], length: int, runs: int) -> None:
    """Raise InputError if the images that are on their way would be too many."""
    marks = sum(len(sight.target.marks) for sight in sights)
    estimate = 24.0 * marks * length * min(max(runs, WIDTH), TOGETHER)
    if estimate > SMALL and estimate > (free := room()):
        raise InputError(
            f"latency: {length} images on their way at once need about {estimate / 1e9:.1f} GB, "
            f"and {free / 1e9:.1f} GB are free; the latency is {np.max(sensing.latency):g} s"
        )
