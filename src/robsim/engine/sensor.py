"""The sensor: what the cameras deliver to the controller, and the encoders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.engine.images import Images
from robsim.engine.plant import Plant
from robsim.kernels.machine.program import Program
from robsim.servo.given import Given, View
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
        steps: int,
        seed: int,
        numbers: NDArray[np.int64],
        excused: frozenset[Key],
    ) -> None:
        self.program, self.plant, self.sights = program, plant, sights
        key = np.uint64(seed), program.whole(numbers)
        self.images = Images(program, plant, sights, sensing, steps, key, excused)
        self.status = program.rows()
        self.views: list[View] = []

    def remember(self) -> None:
        """Add the stages that remember what was seen in a period, for images that come late."""
        self.images.remember()

    def look(self) -> None:
        """Add the stages that project the marks into the images."""
        images = self.images
        self.views = images.taken(self.plant.placed, images.true, images.seen, self.status)

    def measure(self) -> Given:
        """Add the stages that measure, and return what the controller gets."""
        plant, images = self.plant, self.images
        images.deliver()
        q = plant.measured()
        views = {
            sight.key: View(*images.rows(group), each.frames)
            for sight, each, group in zip(self.sights, self.views, images.groups, strict=True)
        }
        placed = plant.placed if q == plant.q else None
        return Given(self.program, plant.dt, plant.seconds, q, views, placed, age=self.images.age)
