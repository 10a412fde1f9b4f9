"""The drives: how the joints of a scene follow commands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.world.actuation import Actuation
from robsim.world.imperfections.imperfection import Acting
from robsim.world.imperfections.joint_effect import JointEffect, JointPlace, Response
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
    def response(self) -> Response:
        """How the commanded velocities follow."""
        lag, *limits = self.actuation.response(self.scene.nv)
        return Response(lag, *(limit[self.columns] for limit in limits))

    def effects(self, place: JointPlace) -> list[Acting[JointEffect]]:
        """Return the imperfections that act at a place."""
        return [each for each in self.actuation.acting() if each.effect.place is place]
