"""The images that reach the controller: late, rare, lost, hidden or wrong, run by run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from robsim.base.arrays import Array, is_any_nonzero
from robsim.base.errors import InputError
from robsim.base.free_memory import get_free_memory
from robsim.engine.plant import Plant
from robsim.engine.recorder import SMALL
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.images import image_delay, mark_occlusion
from robsim.kernels.images.projection import CONTINUED_STATUS, EACH_STATUS, WORST_STATUS
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.controller_rows import ControllerInputs, ViewRows, add_image
from robsim.world.imperfections.image_effect import ImageEffectStage, ImageRows, MarkGroup
from robsim.world.sensing import Sensing

ROUNDING = 1e-9  # of a period: times that differ by less are one
TOGETHER = 256  # runs of a chunk, unless others are asked for


class ImageStream:
    """The rows of a program with the images that the controller gets, and the stages of them.

    `true` is the first row of the image of this instant, as it truly is, and `seen` that of the
    same without marks that are out of the image, where these are excused. `pixels` and `depth` are
    from `measure` on those of the image that is used. `hidden` has a row for each mark, or is
    -1, and `age` is that of the image in periods, rounded up. `views` and `status` are of `look`.
    """

    def __init__(
        self,
        program: Program,
        plant: Plant,
        sights: tuple[CameraTarget, ...],
        sensing: Sensing,
        steps: int,
        excused: frozenset[PairKey],
    ) -> None:
        self.program, self.plant, self.sights = program, plant, sights
        self.key, self.groups = (plant.seed, program.whole(plant.numbers)), group_marks(sights)
        self.N = sum(group.size for group in self.groups)
        acting = [each for each in sensing.acting() if each.effect.place > ImageEffectStage.TAKEN]
        self.effects = sorted(acting, key=lambda each: each.effect.place)
        self.every, latency, _ = sensing.timing(plant.seconds)
        self.latency = program.number(latency)
        self.excused, self.true = excused, program.rows(3 * self.N)
        self.seen = program.rows(3 * self.N) if excused else self.true
        self.pixels, self.depth = split_image_rows(self.seen)
        self.hidden: BlockRows | None = None
        self.age = program.constant(0.0)
        self.delays, shares = split_latency(latency, plant.seconds, steps)
        self.length = _compute_ring_length(self.delays, steps)
        self.delay, self._passes = program.number(self.delays), bool(shares.any())
        self.share, self.ahead = program.number(shares), program.number(shares * plant.seconds)
        self.status = program.rows()
        self.views: list[ViewRows] = []

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
        return self.every > 1 or any(
            each.effect.place >= ImageEffectStage.HIDDEN for each in self.effects
        )

    def look(self) -> None:
        """Add the stages that project the marks into the images."""
        self.views = self.taken(self.plant.placed, self.true, self.seen, self.status)

    def measure(self) -> ControllerInputs:
        """Add the stages that measure, and return what the controller gets."""
        plant = self.plant
        self._deliver()
        q = plant.measured()
        views = {
            sight.key: ViewRows(*self.rows(group), each.frames)
            for sight, each, group in zip(self.sights, self.views, self.groups, strict=True)
        }
        placed = plant.placed if q == plant.q else None
        return ControllerInputs(
            self.program, plant.dt, plant.seconds, q, views, placed, age=self.age
        )

    def remember(self) -> None:
        """Add the stages that keep the image of the period that ends, before the joints move."""
        if not self.late:
            return
        self.ring = self.program.rows(self.length, 3 * self.N)
        between = self._between() if self._passes else self.seen
        given = {"then": self.seen, "between": between, "share": self.share}
        self.program.add(image_delay.store_image, **given, ring=self.ring)

    def _between(self) -> BlockRows:
        """Add the stages of an image that is taken while a period passes; return its rows."""
        found = self.program.rows(3 * self.N)
        seen = self.program.rows(3 * self.N) if self.excused else found
        self.taken(self.plant.within(self.ahead), found, seen, self.program.rows())
        return seen

    def taken(
        self, placed: FKStages, image: BlockRows, seen: BlockRows, status: BlockRows
    ) -> list[ViewRows]:
        """Add the stages of an image of bodies that are placed, of what is seen, and its status."""
        found, of, taken = [], WORST_STATUS, split_image_rows(image)
        shown = taken if seen is image else split_image_rows(seen)
        for sight, group in zip(self.sights, self.groups, strict=True):
            some = group.rows
            rows = [part[some] for part in taken]
            to = rows if seen is image else [part[some] for part in shown]
            if sight.key in self.excused:
                each = self.program.rows(len(sight.target.marks))
                found.append(add_image(self.program, placed, sight, *rows, each, of=EACH_STATUS))
                given = dict(zip(("pixels", "depth", "seen", "seen_depth"), rows + to, strict=True))
                self.program.add(mark_occlusion.blank_missing_marks, **given, status=each)
                continue
            found.append(add_image(self.program, placed, sight, *rows, status, of=of))
            of = CONTINUED_STATUS
            if seen != image:
                for part, other in zip(rows, to, strict=True):
                    self.program.add(copy_rows, rows=part.flat, to=other.flat)
        return found

    def rows(self, group: MarkGroup) -> tuple[BlockRows, BlockRows, BlockRows | None]:
        """Return the rows of pixels, depths and whether they are hidden, of some of the marks."""
        hidden = self.hidden[group.rows] if self.hidden is not None else None
        return self.pixels[group.rows], self.depth[group.rows], hidden

    def _deliver(self) -> None:
        """Add the stages from the true image to the one that is used."""
        if self.late:
            self._recall()
        image = self._affected()
        self.pixels = image.pixels
        if self._keeps:
            self._receive(image)

    def _recall(self) -> None:
        """Let the image be one that was taken some time ago."""
        program, count = self.program, 3 * self.N
        first, out = program.rows(count), program.rows(count)
        program.add(
            image_delay.recall_image,
            every=self.every,
            now=self.seen,
            first=first,
            ring=self.ring,
            delays=self.delay,
            out=out,
        )
        (self.pixels, self.depth), self.age = split_image_rows(out), self.delay

    def _affected(self) -> ImageRows:
        """Add the stages of all imperfections, from where they act on the way of the image."""
        program, gone = self.program, self.program.rows(self.N + 1)  # zeros
        rows = self.pixels, gone[: self.N], gone[self.N], self.plant.dt, self.latency
        image = ImageRows(program, self.groups, self.every, *rows, *self.key)
        for each in self.effects:
            image.stream = each.stream
            each.effect.add_stages(image)
        return image

    def _receive(self, image: ImageRows) -> None:
        """Let lost images, hidden marks and the time between images leave what was there before."""
        program, N = self.program, self.N
        taken, depth, hidden, age = (program.rows(*shape) for shape in ((N, 2), (N,), (N,), ()))
        program.add(
            image_delay.receive_image,
            every=self.every,
            pixels=image.pixels,
            depth=self.depth,
            hidden=image.hidden,
            lost=image.lost,
            delay=self.delay,
            taken=taken,
            taken_depth=depth,
            hides=hidden,
            age=age,
        )
        self.pixels, self.depth, self.age = taken, depth, age
        if any(each.effect.place is ImageEffectStage.HIDDEN for each in self.effects):
            self.hidden = hidden


def split_image_rows(image: BlockRows) -> tuple[BlockRows, BlockRows]:
    """Return the rows of the pixels (N, 2) and of the depths (N,) of an image."""
    N = image.size // 3
    return BlockRows(image, (N, 2)), BlockRows(image + 2 * N, (N,))


def group_marks(sights: Sequence[CameraTarget]) -> list[MarkGroup]:
    """Return the marks of each camera and target, as they stand in the rows of an image."""
    counts = [len(sight.target.marks) for sight in sights]
    each = zip(sights, accumulate(counts, initial=0), counts, strict=False)
    return [MarkGroup(*sight.key, first, count) for sight, first, count in each]


def split_latency(latency: float | Array, dt: float, steps: int) -> tuple[Array, Array]:
    """Return in how many whole periods images come, and which share of the first passes before.

    An image that comes after the last step is as late as any other that does.
    """
    if not is_any_nonzero(latency):
        return np.zeros(1), np.zeros(1)
    periods = np.minimum(np.atleast_1d(latency) / dt, steps + 1.0)
    delay = np.ceil(periods - ROUNDING)
    share = delay - periods
    return delay, np.where(share > ROUNDING, share, 0.0)


def check_sensing(
    sensing: Sensing, sights: Sequence[CameraTarget], dt: float, steps: int, runs: int
) -> None:
    """Raise InputError if an imperfection fits neither marks nor times, or takes much memory."""
    latency = sensing.timing(dt).latency
    _check_image_memory(
        latency, sights, _compute_ring_length(split_latency(latency, dt, steps)[0], steps), runs
    )
    groups = group_marks(sights)
    for each in sensing.acting():
        each.effect.check(groups)


def _compute_ring_length(delays: Array, steps: int) -> int:
    """Return how many past images are kept: none for what does not arrive before the end."""
    return int(np.where(delays > steps, 0.0, delays).max(initial=1.0))


def _check_image_memory(
    latency: float | Array, sights: Sequence[CameraTarget], length: int, runs: int
) -> None:
    """Raise InputError if the images that are on their way would be too many."""
    marks = sum(len(sight.target.marks) for sight in sights)
    estimate = 24.0 * marks * length * min(max(runs, WIDTH), TOGETHER)
    if estimate > SMALL and estimate > (free := get_free_memory()):
        raise InputError(
            f"latency: {length} images on their way at once need about {estimate / 1e9:.1f} GB, "
            f"and {free / 1e9:.1f} GB are free; the latency is {np.max(latency):g} s"
        )
