"""The drives: how the joints of a scene follow commands, and in which steps encoders count."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class Drives:
    """The drives of the joints of a scene, of which `columns` are commanded."""

    actuation: Actuation
    scene: Scene
    columns: NDArray[np.int64]

    @property
    def moves(self) -> bool:
        """Whether joints move otherwise than commanded, as does a car that must steer."""
        return self.actuation.moves or bool(self.scene.tree.cars)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """The limits of velocity and acceleration of the commanded velocities."""
        velocity, acceleration = (
            frozen(self.actuation.limits(which, self.scene.nv)[self.columns])
            for which in ("velocity", "acceleration")
        )
        return velocity, acceleration

    @cached_property
    def steps(self) -> Array:
        """The encoder step of each coordinate (nq,); zero where a joint has no encoder."""
        steps = np.zeros(self.scene.nq)
        given = np.full(self.scene.nq, self.actuation.encoder, dtype=float)
        counted = self.scene.tree.alone(np.arange(self.scene.nv))
        counted = counted[counted >= 0]
        steps[counted] = given[counted]
        return frozen(steps)
