"""The image stream: images with delay, loss, occlusion and noise for the controller."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
from robsim.vision.detectors.mark_detector import MarkDetector
from robsim.world.imperfections.image_effect import (
    ImageEffect,
    ImageEffectStage,
    ImageRows,
    MarkGroup,
)
from robsim.world.imperfections.imperfection import ActiveImperfection
from robsim.world.sensing import Sensing

ROUNDING = 1e-9  # periods; times that differ by less are equal
TOGETHER = 256  # default number of runs in a chunk


class ImageStream:
    """Rows and stages of a program for the images of the controller.

    `true` is the first row of the true image at this instant. If the task allows marks outside the
    image, `seen` is the true image without these marks; else it equals `true`. After `measure`,
    `pixels` and `depth` are the image that the controller uses, `hidden` has a row for each mark or
    is None, and `age` is the age of that image in periods, rounded up. `add_image_stages` sets
    `views` and `status`. If the task uses pictures of cameras (`pictured`), an image also has the
    coordinates of the scene at its time and before: its pictures are drawn when it arrives.
    """

    def __init__(
        self,
        program: Program,
        plant: Plant,
        sights: tuple[CameraTarget, ...],
        sensing: Sensing,
        steps: int,
        optional_pairs: frozenset[PairKey],
        detectors: Mapping[PairKey, MarkDetector],
        believed: Mapping[PairKey, CameraTarget],
        pictured: Mapping[str, CameraTarget],
    ) -> None:
        self.program, self.plant, self.sights = program, plant, sights
        self.detectors, self.believed, self.pictured = detectors, believed, pictured
        self.key, self.groups = (plant.seed, program.whole(plant.numbers)), group_marks(sights)
        self.N = sum(group.size for group in self.groups)
        acting = [
            each for each in sensing.list_active() if each.effect.place > ImageEffectStage.TAKEN
        ]
        self.effects = sorted(acting, key=lambda each: each.effect.place)
        self.every, latency, _ = sensing.timing(plant.seconds)
        self.latency = program.number(latency)
        self.width = 3 * self.N + (2 * plant.scene.nq + 1 if pictured else 0)
        self.before = program.each(plant.start.T) if pictured else plant.q
        self.optional_pairs, self.true = optional_pairs, program.rows(self.width)
        self.seen = program.rows(self.width) if optional_pairs else self.true
        (self.pixels, self.depth), self.exposed = (
            self._split_image(self.seen),
            self.seen[3 * self.N :],
        )
        self.hidden: BlockRows | None = None
        self.age = program.constant(0.0)
        self.delays, shares = split_latency(latency, plant.seconds, steps)
        self.length = _compute_ring_length(self.delays, steps)
        self.delay, self._passes = program.number(self.delays), bool(shares.any())
        self.share, self.ahead = program.number(shares), program.number(shares * plant.seconds)
        self.status = program.rows()
        self.hashes = program.rows(len(pictured))
        self.views: list[ViewRows] = []

    @property
    def fresh(self) -> bool:
        """Whether the controller always uses the image of the present instant."""
        return not (self.late or self._reuses_images)

    @property
    def late(self) -> bool:
        """Whether images arrive with a delay."""
        return bool(self.delays.any())

    @property
    def _reuses_images(self) -> bool:
        """Whether an image, or some of its marks, may be used more than once."""
        return self.every > 1 or self._hides

    @property
    def _hides(self) -> bool:
        """Whether an image may be lost, or lack some of its marks."""
        return bool(self.detectors) or any(
            each.effect.place >= ImageEffectStage.HIDDEN for each in self.effects
        )

    def _split_image(self, image: BlockRows) -> tuple[BlockRows, BlockRows]:
        """Return the rows of the pixels (N, 2) and of the depths (N,) of an image."""
        return BlockRows(image, (self.N, 2)), BlockRows(image + 2 * self.N, (self.N,))

    def add_image_stages(self) -> None:
        """Add the stages that project the marks into the images."""
        rows = self.true, self.seen, self.status, self.plant.dt
        self.views = self.add_projections(self.plant.placed, *rows)

    def measure(self) -> ControllerInputs:
        """Add the stages that measure, and return the input of the controller."""
        plant = self.plant
        self._add_transport()
        q = plant.add_measured_joints()
        views = {
            sight.key: ViewRows(*self.rows(group), each.frames)
            for sight, each, group in zip(self.sights, self.views, self.groups, strict=True)
        }
        placed = plant.placed if q == plant.q else None
        age = None if self.fresh else self.age
        return ControllerInputs(self.program, plant.dt, plant.seconds, q, views, placed, age=age)

    def remember(self) -> None:
        """Add the stages that store the image of the past period, before the joints move."""
        if self.pictured:
            self.program.add(copy_rows, rows=self.plant.q, to=self.before)
        if not self.late:
            return
        self.ring = self.program.rows(self.length, self.width)
        between = self._add_intermediate_image() if self._passes else self.seen
        images = {"start_image": self.seen, "later_image": between, "share": self.share}
        self.program.add(image_delay.store_image, **images, ring=self.ring)

    def _add_intermediate_image(self) -> BlockRows:
        """Add the stages of an image within the past period, and return its rows."""
        image = self.program.rows(self.width)
        seen = self.program.rows(self.width) if self.optional_pairs else image
        placed = self.plant.place_within_period(self.ahead)
        self.add_projections(placed, image, seen, self.program.rows(), self.ahead)
        return seen

    def add_projections(
        self,
        placed: FKStages,
        image: BlockRows,
        seen: BlockRows,
        status: BlockRows,
        seconds: BlockRows,
    ) -> list[ViewRows]:
        """Add the stages that project the marks of placed bodies into an image.

        `seen` gets the image, without the marks of optional pairs that are outside of it. `status`
        gets the worst status of the marks of all other pairs. `seconds` is the time since the start
        of the period. Return the views.
        """
        views, of, taken = [], WORST_STATUS, self._split_image(image)
        shown = taken if seen is image else self._split_image(seen)
        if self.pictured:
            self._add_exposure(placed, seconds, seen[3 * self.N :])
        for sight, group in zip(self.sights, self.groups, strict=True):
            some = group.rows
            rows = [part[some] for part in taken]
            to = rows if seen is image else [part[some] for part in shown]
            if sight.key in self.optional_pairs:
                each = self.program.rows(len(sight.target.marks))
                views.append(add_image(self.program, placed, sight, *rows, each, of=EACH_STATUS))
                parts_of_image = dict(
                    zip(("pixels", "depth", "visible_pixels", "depth_out"), rows + to, strict=True)
                )
                self.program.add(mark_occlusion.blank_missing_marks, **parts_of_image, status=each)
                continue
            views.append(add_image(self.program, placed, sight, *rows, status, of=of))
            of = CONTINUED_STATUS
            if seen != image:
                for part, other in zip(rows, to, strict=True):
                    self.program.add(copy_rows, rows=part.flat, to=other.flat)
        return views

    def _add_exposure(self, placed: FKStages, seconds: BlockRows, exposed: BlockRows) -> None:
        """Add the stages that store the coordinates of an image and those before, with the time."""
        nq = placed.q.size
        parts = placed.q, self.before, seconds.reshape(1)
        places = exposed[:nq], exposed[nq : 2 * nq], exposed[2 * nq :]
        for part, to in zip(parts, places, strict=True):
            self.program.add(copy_rows, rows=part, to=to)

    def rows(self, group: MarkGroup) -> tuple[BlockRows, BlockRows, BlockRows | None]:
        """Return the rows of pixels, depths and occlusion of a group of marks."""
        hidden = self.hidden[group.rows] if self.hidden is not None else None
        return self.pixels[group.rows], self.depth[group.rows], hidden

    def _add_transport(self) -> None:
        """Add the stages from the true image to the image that the controller uses."""
        if self.late:
            self._add_delay()
        image = self._add_effects()
        self.pixels = image.pixels
        if self._reuses_images:
            self._add_reuse(image)

    def _add_delay(self) -> None:
        """Add the stages that replace the image by an older one."""
        program, count = self.program, self.width
        first, out = program.rows(count), program.rows(count)
        program.add(
            image_delay.recall_image,
            every=self.every,
            current_image=self.seen,
            first_image=first,
            ring=self.ring,
            delays=self.delay,
            out=out,
        )
        (self.pixels, self.depth), self.exposed = self._split_image(out), out[3 * self.N :]
        self.age = self.delay

    def _add_effects(self) -> ImageRows:
        """Add the stages of all imperfections, in their order from the camera to the controller."""
        program, zeros = self.program, self.program.rows(self.N + 1)  # initially zero
        rows = self.pixels, zeros[: self.N], zeros[self.N], self.plant.dt, self.latency
        image = ImageRows(program, self.groups, self.every, *rows, *self.key)
        effects = self.effects
        if self.pictured:  # a lost image need not be drawn
            lost = [each for each in effects if each.effect.place is ImageEffectStage.LOST]
            _add_effects_to(image, lost)
            self._add_pictures(image)
            effects = [each for each in effects if each not in lost]
        _add_effects_to(image, effects)
        return image

    def _add_pictures(self, image: ImageRows) -> None:
        """Add the stages that draw the pictures, and detect marks in them."""
        from robsim.engine.picture_taking import PictureRows, PictureTaking

        rows = PictureRows(image, self.exposed, self.hashes)
        self.program.call(PictureTaking(self.pictured, rows))
        if self.detectors:
            self._add_detection(image)

    def _add_detection(self, image: ImageRows) -> None:
        """Add the stage that detects marks in the pictures."""
        from robsim.engine.mark_detection import DetectionRows, MarkDetection

        pixels, last = image.own_pixels(), self.program.rows(self.N, 2)
        rows = DetectionRows(image, pixels, last, self.status)
        pairs = self.detectors, self.believed, self.optional_pairs
        self.program.call(MarkDetection(self.sights, self.groups, *pairs, rows))

    def _add_reuse(self, image: ImageRows) -> None:
        """Add the stage that keeps old pixels for lost images, hidden marks and between frames."""
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
            used_pixels=taken,
            used_depth=depth,
            used_hidden=hidden,
            age=age,
        )
        self.pixels, self.depth, self.age = taken, depth, age
        hiding = [each.effect.place is ImageEffectStage.HIDDEN for each in self.effects]
        if self.detectors or any(hiding):
            self.hidden = hidden


def _add_effects_to(image: ImageRows, effects: Iterable[ActiveImperfection[ImageEffect]]) -> None:
    """Add the stages of effects on an image, in their order."""
    for each in effects:
        image.stream = each.stream
        each.effect.add_stages(image)


def group_marks(sights: Sequence[CameraTarget]) -> list[MarkGroup]:
    """Return the groups of marks of each camera and target, in the order of the image rows."""
    counts = [len(sight.target.marks) for sight in sights]
    each = zip(sights, accumulate(counts, initial=0), counts, strict=False)
    return [MarkGroup(*sight.key, first, count) for sight, first, count in each]


def split_latency(latency: float | Array, dt: float, steps: int) -> tuple[Array, Array]:
    """Return the delay of images in whole periods, and the share of a period to subtract.

    Delays beyond the last step are equivalent and are clipped.
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
    """Raise InputError if an imperfection does not fit the marks or times, or needs much memory."""
    latency = sensing.timing(dt).latency
    _check_image_memory(
        latency, sights, _compute_ring_length(split_latency(latency, dt, steps)[0], steps), runs
    )
    groups = group_marks(sights)
    for each in sensing.list_active():
        each.effect.check(groups)


def _compute_ring_length(delays: Array, steps: int) -> int:
    """Return the number of stored past images; 0 for delays beyond the end of the run."""
    return int(np.where(delays > steps, 0.0, delays).max(initial=1.0))


def _check_image_memory(
    latency: float | Array, sights: Sequence[CameraTarget], length: int, runs: int
) -> None:
    """Raise InputError if the delayed images need too much memory."""
    marks = sum(len(sight.target.marks) for sight in sights)
    estimate = 24.0 * marks * length * min(max(runs, WIDTH), TOGETHER)
    if estimate > SMALL and estimate > (free := get_free_memory()):
        raise InputError(
            f"latency: {length} delayed images at once need about {estimate / 1e9:.1f} GB, "
            f"and {free / 1e9:.1f} GB are free; the latency is {np.max(latency):g} s"
        )
