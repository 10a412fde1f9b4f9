"""The sensor: what the cameras deliver to the controller, and the encoders."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from robsim.kernels import sensing as kernels
from robsim.kernels import viewing
from robsim.kernels.program import Program
from robsim.run.chunk import Chunk
from robsim.run.images import Image, ImageStream, Marks, Noise
from robsim.run.plant import Plant
from robsim.servo.given import Given, View, view
from robsim.servo.sight import Key, Sight
from robsim.world.sensing import Sensing


class Sensor:
    """The rows of a program with what is seen, and of what the controller gets of it."""

    def __init__(
        self,
        program: Program,
        plant: Plant,
        sights: tuple[Sight, ...],
        sensing: Sensing,
        seed: int,
        numbers: NDArray[np.int64],
    ) -> None:
        self.program, self.plant, self.sights, self.sensing = program, plant, sights, sensing
        self.seed = np.uint64(seed)
        counts = [len(sight.target.marks) for sight in sights]
        self.marks = np.cumsum([0, *counts]).tolist()  # number of the first of each sight
        self.run = program.whole(numbers)
        self.pixels, self.depth = program.rows(2 * self.marks[-1]), program.rows(self.marks[-1])
        self.status = program.rows()
        self.prompt = sensing.only_noise and not plant.drives.actuation.counts
        self.measured, self.measured_depth, self.q = self.pixels, self.depth, plant.q
        self.age = program.rows()
        self.views: list[View] = []

    def remember(self) -> None:
        """Add the stage that remembers where a period began, for images that come late."""
        if not self.prompt and self.sensing.latency:
            self.program.call(self._remember)

    def look(self) -> None:
        """Add the stages that project the marks into the images."""
        for i, sight in enumerate(self.sights):
            first = self.marks[i]
            image = self.pixels + 2 * first, self.depth + first, self.status
            of = viewing.MORE if i else viewing.FIRST
            self.views.append(view(self.program, self.plant.placed, sight, *image, of=of))

    def measure(self) -> Given:
        """Add the stages that measure, and return what the controller gets."""
        program, N = self.program, self.marks[-1]
        if not self.prompt:
            self.measured, self.measured_depth = program.rows(2 * N), program.rows(N)
            self.q = program.rows(self.plant.scene.nq)
            program.call(self._deliver)
        elif np.any(self.sensing.noise):
            sigma = program.each(np.reshape(self.sensing.noise, (1, -1)))
            self.measured = program.rows(2 * N)
            signed = int(self.seed.astype(np.int64))
            rows = self.pixels, sigma, signed, self.run, self.measured
            program.add(kernels.blur, N, *rows)
        views = {
            sight.key: View(
                each.T_w_c, each.T_w_o, self.measured + 2 * first, self.measured_depth + first
            )
            for sight, each, first in zip(self.sights, self.views, self.marks, strict=False)
        }
        placed = self.plant.placed if self.prompt else None
        plant, hides = self.plant, bool(self.sensing.occlusions)
        return Given(program, plant.dt, plant.seconds, self.q, views, placed, hides)

    def _remember(self, chunk: Chunk, step: int) -> None:
        chunk.images.note(self.plant.period(chunk))

    def _deliver(self, chunk: Chunk, step: int) -> None:
        """Write the image that is there at a step, and what the encoders read."""
        N, images = self.marks[-1], chunk.images
        marks = Marks(chunk.get(self.pixels, N, 2), chunk.get(self.depth, N))
        numbers = chunk.get(self.run, 1)[0].view(np.uint64)
        image = images.at(step, marks, Noise(self.sensing.noise, self.seed, numbers))
        chunk.put(self.measured, image.pixels)
        chunk.put(self.measured_depth, image.depth)
        chunk.put(self.q, self.plant.drives.counted(chunk.get(self.plant.q, self.plant.scene.nq)))
        age = np.broadcast_to(np.asarray(images.age(step), dtype=float), (1, chunk.runs))
        chunk.put(self.age, age)
        chunk.hidden = self._hidden(image)

    def _hidden(self, image: Image) -> dict[Key, NDArray[np.bool_]]:
        """Return which marks (N, B) of each sight are hidden, if any mark is."""
        if not image.hidden.any():
            return {}
        rows = [slice(*pair) for pair in pairwise(self.marks)]
        return {s.key: image.hidden[r] for s, r in zip(self.sights, rows, strict=True)}


def stream(sensor: Sensor) -> ImageStream:
    """Return the images of a chunk of runs at its start."""
    plant = sensor.plant
    return ImageStream(sensor.sensing, sensor.sights, plant.drives, plant.seconds)
