"""The weighting by the way to the border of the image, for marks that leave it and come back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Integer, Number, PerRun, register
from robsim.kernels.control import mark_weights as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.weightings.weighting_protocol import MarkRows, MarkWeighting


@register("weighting", "border")
@dataclass(frozen=True)
class Border(MarkWeighting, DeclaredValue):
    """The weighting by which marks count less and less towards the border of the image.

    The weight of a mark is 0 outside the image and behind the camera, 1 from `width` pixels inside
    on, and between them a polynomial with two continuous derivatives. So the command is continuous
    where marks leave and enter the image (Garcia-Aracil, Malis, Aracil-Santonja and Perez-Vidal
    2005), as long as those that count in full determine it alone (Mansard, Remazeilles and
    Chaumette 2009). A run begins without marks that are out of the image, and goes on without
    them, until L J of those that are left has a lower rank than at the goal, or fewer than `least`
    are left.

    >>> Border(width=40).least
    1
    """

    excuses: ClassVar[bool] = True

    width: Annotated[
        float,
        Number(above=0, unit="px"),
        PerRun(()),
        "Distance from the border from which on a mark counts in full.",
    ] = 40.0
    least: Annotated[
        int, Integer(1, 10_000), "Marks that must be in the image for the run to go on."
    ] = 1

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a sight, and return their rows."""
        program = of.given.program
        image = {"pixels": of.view.pixels, "camera": of.camera}
        return program.result(
            kernels.weight_border_distance, "out", of.N, **image, width=program.number(self.width)
        )
