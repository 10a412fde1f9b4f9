"""The coordinates of a body that hangs from a rail by two wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import Length, Word, check_fields, register
from robsim.geometry.curves import Curve
from robsim.kernels.bodies import forward_kinematics
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.joints.couplings import CoordinateType, Coupling, SourceName

CHORD_QUANTITIES = ("angle", "arc", "height", "tilt")  # in the order of the kernel's numbers


@register("coupling", "chord")
@dataclass(frozen=True)
class Chord(Coupling):
    """A coordinate of a body that hangs from a rail by two wheels, `length` apart.

    The first wheel touches the curve of the rail joint `of` at its coordinate s, and its centre
    lies `radius` beside the curve (metres, to the left of the way); the centre of the second lies
    `length` from that of the first, as far beside the curve, further along it. A third wheel may
    touch the curve between them, `at` metres along the chord; by default it is the second. What
    the coordinate is:

    "angle"   of the chord, from the tangent at the first wheel (radians)
    "arc"     s of the point where the third wheel touches the curve (metres)
    "height"  of the centre of the third wheel above the chord (metres)
    "tilt"    of the tangent where the third wheel touches, from the chord (radians)

    >>> Chord("rear", 0.4, gives="angle").at
    0.4
    """

    limited = False
    on_a_curve = True
    wanted = "a rail of its own speed"
    of: SourceName
    length: Annotated[float, Length(above=0), "Distance between the centres of the two wheels."]
    radius: Annotated[
        float, Length(), "Radius of the wheels, whose centres lie to the left of the curve."
    ] = 0.0
    at: Annotated[
        float | None,
        Length(above=0),
        "Distance along the chord of the third wheel; None: at its end.",
    ] = None
    gives: Annotated[
        Literal["angle", "arc", "height", "tilt"],
        Word(CHORD_QUANTITIES),
        "Quantity that the coordinate is.",
    ] = "arc"

    def __post_init__(self) -> None:
        check_fields(self)
        if self.at is None:
            object.__setattr__(self, "at", self.length)
        elif self.at > self.length:
            raise InputError(
                f"chord at must not exceed its length {self.length:g}, got {self.at:g}"
            )

    @property
    def yields(self) -> CoordinateType:
        """The kind of coordinate that it gives: an angle, or a length."""
        return "an angle" if self.gives in ("angle", "tilt") else "a length"

    @property
    def relation(self) -> str:
        """The quantity that it gives, and the chord, for overviews."""
        return f"{self.gives} of the chord of {self.length:g} m from {self.of}"

    def fits(self, source: Any, steers: bool) -> bool:
        """Return whether the source is a rail that follows nothing."""
        return source.model.needs == "curve" and source.follows is None

    @property
    def constants(self) -> tuple[float, float, float]:
        """The length, the radius, and the position of the third wheel."""
        assert self.at is not None  # set in __post_init__
        return self.length, self.radius, self.at

    def add_stages(self, placed: Any, which: int, **rows: BlockRows) -> None:
        """Add the stage of what it gives, on the curve with this number."""
        what = CHORD_QUANTITIES.index(self.gives)
        placed.program.add(
            forward_kinematics.evaluate_chord, **placed.curves, **rows, which=which, what=what
        )

    def check(self, name: str, curve: Curve) -> None:
        """Raise InputError if a wheel does not fit a bend, or the chord does not fit the curve.

        Wheel centres beside a circle of curvature k are on one of radius |1/k - radius|. Around
        half of it and more, a chord as long as its diameter would jump from one side to the other.
        """
        sharpest = max(curve.bends, key=lambda k: k * self.radius)
        if sharpest * self.radius >= 1.0:
            raise InputError(
                f"'{name}': a wheel of radius {abs(self.radius):g} m does not fit into a bend of "
                f"radius {1 / abs(sharpest):g} m"
            )
        k, turn = curve.pieces[:, 4], curve.pieces[:, 4] * curve.spans
        short = (np.abs(turn) >= np.pi) & (2.0 * (1.0 - self.radius * k) <= self.length * np.abs(k))
        if short.any():
            raise InputError(
                f"'{name}': a chord of {self.length:g} m does not fit on a circle of radius "
                f"{1 / np.abs(k[short]).max():g} m"
            )
