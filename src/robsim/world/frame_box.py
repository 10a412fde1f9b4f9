"""A box of the world, and the frame that is within or outside of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Vector
from robsim.declare.texts import FrameReference
from robsim.world.scene import Scene


@dataclass(frozen=True)
class FrameBox(DeclaredValue):
    """The part of a declaration that is about the origin of a frame and a box of the world."""

    frame: Annotated[str, FrameReference, "Frame whose origin is looked at."]
    low: Annotated[Any, Vector("length"), "Corner of the box with its lowest x, y and z."]
    high: Annotated[Any, Vector("length"), "Corner of the box with its highest x, y and z."]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.less(self.low, self.high).all():
            raise InputError(
                f"{type(self).__name__.lower()}: low must be below high, got {self.low} and "
                f"{self.high}"
            )

    def check(self, scene: Scene) -> None:
        """Raise FrameError unless the scene has the frame."""
        scene.tree.find(self.frame)
