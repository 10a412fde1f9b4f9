"""Weighting by the distance to the border of the image, for marks that leave it and come back."""

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
    """Weighting by the distance to the border of the image.

    The weight of a mark is 0 outside the image and behind the camera, 1 from `width` pixels
    inside, and between them a polynomial with two continuous derivatives. Use it if marks may
    leave the image: a run then does not end when a mark is lost. The command is continuous as
    marks leave and enter (Garcia-Aracil, Malis, Aracil-Santonja and Perez-Vidal 2005) if the marks
    with full weight alone determine the command (Mansard, Remazeilles and Chaumette 2009). A larger
    `width` makes the transitions gentler, but gives fewer marks full weight.

    Raises
    ------
    InputError
        By `simulate`, if the size of the image is unknown; if the task has a `DepthFilter` or
        `Broyden`, which must follow every mark.

    Notes
    -----
    A run may start with marks outside the image. It ends if L J of the remaining marks has a lower
    rank than at the goal, or if fewer than `least` marks remain.

    Examples
    --------
    Without a weighting the run ends when the first mark leaves the image:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("marks_come_and_go"))
    >>> for weighting in (), (rs.weights.Border(width=40), rs.weights.Fade(time=0.4)):
    ...     task = replace(scenario.task, weighting=weighting)
    ...     run = replace(scenario, task=task).run()
    ...     print(rs.Outcome(int(run.outcome)).name)
    OUT_OF_IMAGE
    CONVERGED
    """

    excuses: ClassVar[bool] = True

    width: Annotated[
        float,
        Number(above=0, unit="px"),
        PerRun(()),
        "Distance from the border beyond which a mark has full weight.",
    ] = 40.0
    least: Annotated[
        int, Integer(1, 10_000), "Smallest number of marks in the image; with fewer, the run ends."
    ] = 1

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a pair; return their rows."""
        program = of.inputs.program
        image = {"pixels": of.view.pixels, "camera": of.camera}
        return program.result(
            kernels.weight_border_distance, "out", of.N, **image, width=program.number(self.width)
        )
