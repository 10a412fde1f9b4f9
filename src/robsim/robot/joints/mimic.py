"""Coordinates that are linear functions of another coordinate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.declare import Number, check_fields, register
from robsim.declare.joint_numbers import OfJoint
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.couplings import Coupling, SourceJoint, SourceName


@register("coupling", "mimic")
@dataclass(frozen=True)
class Mimic(Coupling):
    """Coordinate that is a linear function of another coordinate.

    The coordinate is q = ratio * q_of + offset, as in the element <mimic> of URDF. Use it for the
    second finger of a gripper, for example.

    Examples
    --------
    >>> Mimic("finger_left").ratio
    1.0
    """

    stage = forward_kinematics.mimic_coordinate
    without_controls: ClassVar[tuple[str, ...]] = ("offset",)

    of: SourceName
    ratio: Annotated[float, Number(), "Ratio of the changes of both coordinates."] = 1.0
    offset: Annotated[float, OfJoint(), "Value if the other coordinate is zero."] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def relation(self) -> str:
        """Ratio, name and offset, for overviews."""
        offset = f" {self.offset:+g}" if self.offset else ""
        return f"{self.ratio:g} {self.of}{offset}"

    def fits(self, source: SourceJoint, steers: bool) -> bool:
        """Return whether the source is a single independent coordinate, or a steering angle."""
        rolls = source.follows is not None and not source.follows.is_coupled
        return steers or (source.model.single and not rolls)

    @property
    def constants(self) -> tuple[float, float, float]:
        """Ratio and offset."""
        return self.ratio, self.offset, 0.0

    def through(self, above: Mimic) -> Mimic:
        """Return the coupling to the last source, if `above` is the coupling of the present source.

        Examples
        --------
        >>> Mimic("b", 2.0, 1.0).through(Mimic("a", 3.0, -1.0))
        Mimic(of='a', ratio=6.0, offset=-1.0)
        """
        return Mimic(above.of, self.ratio * above.ratio, self.ratio * above.offset + self.offset)

    def root(self, follows: Mapping[str, Coupling | None]) -> Mimic:
        """Return the coupling to the last source of a chain of mimics.

        The mapping `follows` holds the couplings of coordinates by their names.
        """
        tie = self
        while isinstance(above := follows.get(tie.of), Mimic):
            tie = tie.through(above)
        return tie

    def source_limits(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return (lowest, highest) of the source that keep this coordinate within its limits.

        Examples
        --------
        >>> Mimic("finger_left", -2.0, 1.0).source_limits((0.0, 2.0))
        (-0.5, 0.5)
        """
        if self.ratio == 0.0:
            return -np.inf, np.inf
        with np.errstate(over="ignore"):  # a tiny ratio gives infinite limits
            ends = (np.array(limits) - self.offset) / self.ratio + 0.0
        return float(ends.min()), float(ends.max())
