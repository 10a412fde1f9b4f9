"""Coordinates that are linear functions of another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.declare import Number, check_fields, register
from robsim.declare.joints import OfJoint
from robsim.kernels.bodies import placing
from robsim.kernels.machine.stage import Stage
from robsim.robot.joints.coupling import Coupling, Of, Source, Stand


@register("coupling", "mimic")
@dataclass(frozen=True)
class Mimic(Coupling):
    """A coordinate ratio * q_of + offset of the coordinate with the name `of`.

    >>> Mimic("finger_left").ratio
    1.0
    """

    stage: ClassVar[Stage | None] = placing.mimic
    of: Of
    ratio: Annotated[float, Number(), "Ratio of its change to that of the other coordinate."] = 1.0
    offset: Annotated[float, OfJoint(), "Value where the other coordinate is zero."] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def relation(self) -> str:
        """The ratio, name and offset, for overviews."""
        offset = f" {self.offset:+g}" if self.offset else ""
        return f"{self.ratio:g} {self.of}{offset}"

    def fits(self, source: Source) -> bool:
        """Return whether the source is one coordinate of its own speed, or a steering angle."""
        rolls = source.follows is not None and not source.follows.tied
        return source.steers or (source.kind.single and not rolls)

    def constants(self, stand: Stand | None) -> tuple[float, float, float]:
        """Return ratio and offset."""
        return self.ratio, self.offset, 0.0

    def through(self, above: Mimic) -> Mimic:
        """Return how this coordinate follows the source of its source, which is `above`.

        >>> Mimic("b", 2.0, 1.0).through(Mimic("a", 3.0, -1.0))
        Mimic(of='a', ratio=6.0, offset=-1.0)
        """
        return Mimic(above.of, self.ratio * above.ratio, self.ratio * above.offset + self.offset)

    def source_limits(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return (lowest, highest) of the source that keep this coordinate in its limits.

        >>> Mimic("finger_left", -2.0, 1.0).source_limits((0.0, 2.0))
        (-0.5, 0.5)
        """
        if self.ratio == 0.0:
            return -np.inf, np.inf
        with np.errstate(over="ignore"):  # a tiny ratio gives infinite limits
            ends = (np.array(limits) - self.offset) / self.ratio + 0.0
        return float(ends.min()), float(ends.max())
