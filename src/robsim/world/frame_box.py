"""An axis-aligned box in the world, for conditions on the origin of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Vector
from robsim.declare.texts import FrameReference

Corner = Sequence[float] | Array  # x, y and z


@dataclass(frozen=True)
class FrameBox(DeclaredValue):
    """Base class of conditions on the origin of a frame and an axis-aligned box in the world."""

    frame: Annotated[
        str, FrameReference, "Frame of the scene; its origin is compared with the box."
    ]
    low: Annotated[Corner, Vector("length"), "Lowest x, y and z of the box, in metres."]
    high: Annotated[Corner, Vector("length"), "Highest x, y and z of the box, in metres."]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not np.less(self.low, self.high).all():
            raise InputError(
                f"{type(self).__name__.lower()}: low must be below high, got {self.low} and "
                f"{self.high}"
            )
